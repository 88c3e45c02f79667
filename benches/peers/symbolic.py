"""Symbolic dynamics of one arm, written out as C by CasADi with the arm's constants folded in.

    python3 symbolic.py case.txt arm.c

The recursions are the textbook's, on 3-vectors in joint frames; zeros and ones of the arm are
eliminated, common subexpressions are shared. The law is one symbolic function from state to torques.
"""

import sys

import casadi as ca
import numpy as np

import cases


def constant(values):
    """Numbers as symbols, without the rounding errors of rotations by 90 degrees."""
    rounded = np.array(values, dtype=float)
    for exact in (0.0, 1.0, -1.0):
        rounded[np.abs(rounded - exact) < 1e-14] = exact
    return ca.SX(ca.DM(rounded))


def skew(v):
    return ca.vertcat(
        ca.horzcat(0, -v[2], v[1]), ca.horzcat(v[2], 0, -v[0]), ca.horzcat(-v[1], v[0], 0)
    )


def cross(a, b):
    return ca.cross(ca.densify(a), ca.densify(b))


class Arm:
    def __init__(self, case):
        self.n = len(case.joints)
        self.gravity = constant(case.gravity)
        self.tip = (constant(case.tip.rotation), constant(case.tip.translation))
        self.links = []
        turned = np.eye(3)
        for joint in case.joints:
            # Joint frames rotate about their own z axis, as ours do.
            to_axis = z_onto(joint.axis)
            com = to_axis.T @ joint.com
            inertia = to_axis.T @ joint.inertia @ to_axis
            inertia = inertia + joint.mass * (com @ com * np.eye(3) - np.outer(com, com))
            self.links.append(
                dict(
                    rotation=constant(turned.T @ joint.rotation @ to_axis),
                    origin=constant(turned.T @ joint.translation),
                    mass=joint.mass,
                    moment=constant(joint.mass * com),
                    inertia=constant(inertia),
                    to_link=constant(to_axis),
                )
            )
            turned = to_axis
        self.tip = (
            constant(turned.T @ case.tip.rotation),
            constant(turned.T @ case.tip.translation),
        )

    def rotations(self, q):
        out = []
        for i, link in enumerate(self.links):
            s, c = ca.sin(q[i]), ca.cos(q[i])
            turn = ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))
            out.append(link["rotation"] @ turn)
        return out

    def poses(self, rotations):
        r, p, out = ca.SX.eye(3), ca.SX.zeros(3), []
        for link, rotation in zip(self.links, rotations):
            p = p + r @ link["origin"]
            r = r @ rotation
            out.append((r, p))
        return out, (r @ self.tip[0], p + r @ self.tip[1])

    def motion(self, rotations, qd, qdd, gravity):
        """Spin, its rate and acceleration of each joint frame, in that frame."""
        w, wd, a, out = ca.SX.zeros(3), ca.SX.zeros(3), -gravity, []
        z = ca.DM([0, 0, 1])
        for i, (link, r) in enumerate(zip(self.links, rotations)):
            p = link["origin"]
            a = r.T @ (a + cross(wd, p) + cross(w, cross(w, p)))
            w = r.T @ w
            wd = r.T @ wd + cross(w, z * qd[i]) + z * qdd[i]
            w = w + z * qd[i]
            out.append((w, wd, a))
        return out

    def rnea(self, rotations, motion):
        moment, force, tau = ca.SX.zeros(3), ca.SX.zeros(3), [0] * self.n
        for i in reversed(range(self.n)):
            link, (w, wd, a) = self.links[i], motion[i]
            h, inertia = link["moment"], link["inertia"]
            force = force + link["mass"] * a + cross(wd, h) + cross(w, cross(w, h))
            moment = moment + inertia @ wd + cross(w, inertia @ w) + cross(h, a)
            tau[i] = moment[2]
            force, moment = self.to_parent(i, rotations[i], force, moment)
        return ca.vertcat(*tau)

    def to_parent(self, i, r, force, moment):
        force = r @ force
        return force, r @ moment + cross(self.links[i]["origin"], force)

    def crba(self, rotations):
        n = self.n
        h = ca.SX.zeros(n, n)
        mass, moment, inertia = 0, ca.SX.zeros(3), ca.SX.zeros(3, 3)
        for j in reversed(range(n)):
            link, r = self.links[j], rotations[j]
            mass = mass + link["mass"]
            moment = moment + link["moment"]
            inertia = inertia + link["inertia"]
            f = ca.vertcat(-moment[1], moment[0], 0)
            m = inertia[:, 2]
            h[j, j] = m[2]
            for i in reversed(range(j)):
                f, m = self.to_parent(i + 1, rotations[i + 1], f, m)
                h[i, j] = h[j, i] = m[2]
            p = link["origin"]
            turned = r @ moment
            inertia = turned_inertia(r, inertia) + steiner(mass, p, turned)
            moment = turned + mass * p
        return h

    def aba(self, rotations, qd, tau):
        n = self.n
        motion = self.motion(rotations, qd, [0] * n, ca.SX.zeros(3))
        bias, w = [], ca.SX.zeros(3)
        for i, (link, r) in enumerate(zip(self.links, rotations)):
            p = link["origin"]
            accel = r.T @ cross(w, cross(w, p))
            spin = r.T @ w
            bias.append(ca.vertcat(spin[1] * qd[i], -spin[0] * qd[i], 0, accel))
            w = motion[i][0]
        body = ca.SX.zeros(6, 6)
        wrench = ca.SX.zeros(6)
        joint = [None] * n
        for i in reversed(range(n)):
            link, r, w = self.links[i], rotations[i], motion[i][0]
            h = skew(link["moment"])
            body = body + ca.vertcat(
                ca.horzcat(link["inertia"], h), ca.horzcat(h.T, link["mass"] * ca.SX.eye(3))
            )
            wrench = wrench + ca.vertcat(
                cross(w, link["inertia"] @ w), cross(w, cross(w, link["moment"]))
            )
            u = body[:, 2]
            d, drive = 1 / u[2], tau[i] - wrench[2]
            joint[i] = (u, d, drive)
            rest = body - u @ u.T * d
            wrench = wrench + rest @ bias[i] + u * (drive * d)
            x = ca.vertcat(
                ca.horzcat(r.T, ca.SX.zeros(3, 3)), ca.horzcat(-r.T @ skew(link["origin"]), r.T)
            )
            half = x.T @ rest
            body = symmetric(6, lambda i, j: ca.dot(half[i, :].T, x[:, j]))
            wrench = x.T @ wrench
        wd, a, qdd = ca.SX.zeros(3), -self.gravity, []
        for i, (link, r) in enumerate(zip(self.links, rotations)):
            a = r.T @ (a + cross(wd, link["origin"])) + bias[i][3:]
            wd = r.T @ wd + bias[i][:3]
            u, d, drive = joint[i]
            qdd.append((drive - ca.dot(u, ca.vertcat(wd, a))) * d)
            wd = wd + ca.DM([0, 0, 1]) * qdd[i]
        return ca.vertcat(*qdd)

    def regressor(self, rotations, motion):
        n, out = self.n, ca.SX.zeros(self.n, 10 * self.n)
        for k, link in enumerate(self.links):
            to_link = link["to_link"]
            w, wd, a = (to_link @ v for v in motion[k])
            spin = skew(wd) + skew(w) @ skew(w)
            columns = lambda v: ca.vertcat(
                ca.horzcat(v[0], v[1], 0, v[2], 0, 0),
                ca.horzcat(0, v[0], v[1], 0, v[2], 0),
                ca.horzcat(0, 0, 0, v[0], v[1], v[2]),
            )
            force = ca.horzcat(a, spin, ca.SX.zeros(3, 6))
            moment = ca.horzcat(
                ca.SX.zeros(3), -skew(a), columns(wd) + skew(w) @ columns(w)
            )
            force, moment = to_link.T @ force, to_link.T @ moment
            for i in reversed(range(k + 1)):
                out[i, 10 * k : 10 * k + 10] = moment[2, :]
                r, p = rotations[i], self.links[i]["origin"]
                force = r @ force
                moment = r @ moment + skew(p) @ force
        return out

    def jacobian(self, poses, tip):
        columns = []
        for r, p in poses:
            axis = r[:, 2]
            columns.append(ca.vertcat(cross(axis, tip[1] - p), axis))
        return ca.horzcat(*columns)

    def jacobian_dot_qd(self, poses, tip, motion, gravity):
        w, wd, a = motion[-1]
        p = self.tip[1]
        a = a + cross(wd, p) + cross(w, cross(w, p))
        r = poses[-1][0]
        return ca.vertcat(r @ a + gravity, r @ wd)

    def law(self, case, q, qd, reference):
        position, rotation, velocity, acceleration = reference
        d, k = case.task, case.gains
        rotations = self.rotations(q)
        poses, tip = self.poses(rotations)
        motion = self.motion(rotations, qd, [0] * self.n, self.gravity)
        nle = self.rnea(rotations, motion)
        mass = self.crba(rotations)
        j = self.jacobian(poses, tip)[:d, :]
        drift = self.jacobian_dot_qd(poses, tip, motion, self.gravity)[:d]
        speed = j @ qd
        spring = constant(k.stiffness[:3]) * (position - tip[1])
        if d == 6:
            # Gradient of the energy tr(G (1 - E)), E the rotation to the reference, G = tr(K) / 2 - K.
            about = k.stiffness[3:6]
            weight = constant([0.5 * sum(about) - x for x in about])
            turn = rotation @ tip[0].T
            m = ca.vertcat(*[weight[i] * turn[i, :] for i in range(3)])
            spring = ca.vertcat(
                spring, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
            )
        force = spring + constant(k.damping[:d]) * (velocity[:d] - speed)
        wanted = acceleration[:d] - drift
        if d == self.n:
            return nle + mass @ (inverse_3(j) @ wanted) + j.T @ force
        # With H = L L^T and Y = L^-1 J^T: J H^-1 J^T = Y^T Y, and H^-1 J^T x = L^-T Y x.
        lower = cholesky(mass)
        y = solve_lower(lower, j.T)
        mobility = cholesky(gram(y))
        nullspace_velocity = qd - solve_upper(lower, y @ solve(mobility, speed))
        back = y.T @ solve_lower(lower, nullspace_velocity)
        through = solve(mobility, wanted + k.nullspace * back)
        return nle + j.T @ (through + force) - k.nullspace * nullspace_velocity


def z_onto(axis):
    """A rotation that maps z to a unit vector."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    if axis[2] == 1.0:
        return np.eye(3)
    y = np.cross(axis, helper)
    y /= np.linalg.norm(y)
    return np.column_stack([np.cross(y, axis), y, axis])


def steiner(mass, p, moment):
    """Change of the inertia for a shift of the origin by `p`; `moment` is the first moment in the new
    axes."""
    outer = p @ moment.T
    return (
        ca.SX.eye(3) * (2 * ca.dot(p, moment) + mass * ca.dot(p, p))
        - outer
        - outer.T
        - mass * (p @ p.T)
    )


def inverse_3(m):
    a, b, c = m[0, :].T, m[1, :].T, m[2, :].T
    bc = cross(b, c)
    return ca.horzcat(bc, cross(c, a), cross(a, b)) / ca.dot(a, bc)


def cholesky(a):
    n = a.shape[0]
    lower, inverse = ca.SX.zeros(n, n), [None] * n
    for j in range(n):
        d = ca.sqrt(a[j, j] - sum(lower[j, k] ** 2 for k in range(j)))
        inverse[j] = 1 / d
        for i in range(j + 1, n):
            rest = sum(lower[i, k] * lower[j, k] for k in range(j))
            lower[i, j] = (a[i, j] - rest) * inverse[j]
    return lower, inverse


def solve_lower(factor, b):
    lower, inverse = factor
    x = ca.SX(b)
    for i in range(b.shape[0]):
        for k in range(i):
            x[i, :] -= lower[i, k] * x[k, :]
        x[i, :] *= inverse[i]
    return x


def solve_upper(factor, b):
    lower, inverse = factor
    x = ca.SX(b)
    for i in reversed(range(b.shape[0])):
        for k in range(i + 1, b.shape[0]):
            x[i, :] -= lower[k, i] * x[k, :]
        x[i, :] *= inverse[i]
    return x


def solve(factor, b):
    return solve_upper(factor, solve_lower(factor, b))


def symmetric(n, entry):
    """Copies the upper triangle to the lower one, so that each entry is computed once."""
    out = ca.SX.zeros(n, n)
    for i in range(n):
        for j in range(i + 1):
            out[i, j] = out[j, i] = entry(i, j)
    return out


def gram(y):
    return symmetric(y.shape[1], lambda i, j: ca.dot(y[:, i], y[:, j]))


def turned_inertia(r, inertia):
    half = r @ inertia
    return symmetric(3, lambda i, j: ca.dot(half[i, :], r[j, :]))


def functions(case):
    arm = Arm(case)
    n = arm.n
    q, qd, qdd, tau = (ca.SX.sym(name, n) for name in ("q", "qd", "qdd", "tau"))
    position, velocity = ca.SX.sym("position", 3), ca.SX.sym("velocity", 6)
    acceleration = ca.SX.sym("acceleration", 6)
    rotation = ca.SX.sym("rotation", 3, 3)
    rotations = arm.rotations(q)
    poses, tip = arm.poses(rotations)
    moving = arm.motion(rotations, qd, qdd, arm.gravity)
    nothing = ca.SX.zeros(3)
    drifting = arm.motion(rotations, qd, [0] * n, nothing)
    law = arm.law(case, q, qd, (position, rotation.T, velocity, acceleration))
    named = {
        "rnea": ([q, qd, qdd], arm.rnea(rotations, moving)),
        "crba": ([q], arm.crba(rotations)),
        "aba": ([q, qd, tau], arm.aba(rotations, qd, tau)),
        "jacobian": ([q], arm.jacobian(poses, tip)),
        "jdot_qd": ([q, qd], arm.jacobian_dot_qd(poses, tip, drifting, nothing)),
        "regressor": ([q, qd, qdd], arm.regressor(rotations, moving)),
        "law": ([q, qd, position, rotation, velocity, acceleration], law),
    }
    return [
        ca.Function(name, inputs, [ca.densify(output)], {"cse": True})
        for name, (inputs, output) in named.items()
    ]


if __name__ == "__main__":
    generator = ca.CodeGenerator("symbolic.c", {"with_header": False})
    for function in functions(cases.read(sys.argv[1])):
        generator.add(function)
    with open(sys.argv[2], "w", encoding="utf-8") as out:
        out.write(generator.dump())
