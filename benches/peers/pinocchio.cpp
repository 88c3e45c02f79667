// Pinocchio, with the law tuned by hand: one crba and one nle, J and J' qd from their by-products, Eigen
// matrices of fixed size. If Pinocchio has two functions, the faster one is reported.
#define EIGEN_NO_DEBUG
#include <pinocchio/fwd.hpp>

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include "harness.hpp"

namespace pin = pinocchio;
using pin::Model;
using Eigen::Map;
using Eigen::Matrix;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Rows3 = Matrix<double, 3, 3, Eigen::RowMajor>;
using Vector6 = Matrix<double, 6, 1>;

static pin::SE3 pose(const double *rotation, const double *translation) {
  return {Matrix3d(Map<const Rows3>(rotation)), Vector3d(Map<const Vector3d>(translation))};
}

static Model model_of(const Case &c) {
  Model model;
  model.gravity.linear() = Map<const Vector3d>(c.gravity);
  pin::JointIndex parent = 0;
  for (int i = 0; i < c.joints; i++) {
    const Joint &j = c.joint[i];
    const Vector3d axis = Map<const Vector3d>(j.axis);
    const auto placement = pose(j.rotation, j.translation);
    const auto name = "joint" + std::to_string(i + 1);
    // As Pinocchio's URDF reader chooses them.
    if (axis == Vector3d::UnitX())
      parent = model.addJoint(parent, pin::JointModelRX(), placement, name);
    else if (axis == Vector3d::UnitY())
      parent = model.addJoint(parent, pin::JointModelRY(), placement, name);
    else if (axis == Vector3d::UnitZ())
      parent = model.addJoint(parent, pin::JointModelRZ(), placement, name);
    else
      parent = model.addJoint(parent, pin::JointModelRevoluteUnaligned(axis), placement, name);
    const pin::Inertia body(j.mass, Vector3d(Map<const Vector3d>(j.com)),
                            Matrix3d(Map<const Rows3>(j.inertia)));
    model.appendBodyToJoint(parent, body, pin::SE3::Identity());
  }
  model.addFrame(pin::Frame("tip", parent, 0, pose(c.tip_rotation, c.tip_translation),
                            pin::FrameType::OP_FRAME));
  return model;
}

// Quantities that the law derives from one crba and one nle.
template <int N> struct Terms {
  Matrix<double, 6, N> jacobian;
  Vector6 drift;
  pin::SE3 tip;
  Matrix<double, N, N> mass;
  Matrix<double, N, 1> nle;
};

template <int N>
static Terms<N> terms(const Model &model, pin::Data &data, pin::FrameIndex frame, const VectorXd &q,
                      const VectorXd &qd) {
  Terms<N> t;
  pin::crba(model, data, q, pin::Convention::WORLD);
  t.mass = data.M.template selfadjointView<Eigen::Upper>();
  t.nle = pin::nonLinearEffects(model, data, q, qd);
  const pin::SE3 &last_from_tip = model.frames[frame].placement;
  const pin::JointIndex last = model.frames[frame].parentJoint;
  t.tip = data.oMi[last] * last_from_tip;
  t.jacobian = data.J;
  for (int i = 0; i < N; i++)
    t.jacobian.template block<3, 1>(0, i) -=
        t.tip.translation().cross(t.jacobian.template block<3, 1>(3, i));
  const pin::Motion v = last_from_tip.actInv(data.v[last]);
  const pin::Motion a = last_from_tip.actInv(data.a_gf[last]);
  const Matrix3d &r = t.tip.rotation();
  t.drift.template head<3>() =
      r * (a.linear() + v.angular().cross(v.linear())) + model.gravity.linear();
  t.drift.template tail<3>() = r * a.angular();
  return t;
}

template <int N> static auto vector(const std::vector<double> &v) {
  return Map<const Matrix<double, N, 1>>(v.data());
}

// `K (Xo - X) + B (Xo' - X')`.
template <int D, int N>
static Matrix<double, D, 1> feedback(const Gains &gains, const State &s, const Terms<N> &t,
                                     const Matrix<double, D, 1> &velocity) {
  using Vector = Map<const Matrix<double, D, 1>>;
  const Vector3d error = Map<const Vector3d>(s.position) - t.tip.translation();
  Matrix<double, D, 1> spring;
  spring.template head<3>() = Map<const Vector3d>(gains.stiffness).cwiseProduct(error);
  if constexpr (D == 6) {
    // Gradient of the energy tr(G (1 - E)), E the rotation to the reference, G = tr(K) / 2 - K.
    const Vector3d about = Map<const Vector3d>(gains.stiffness + 3);
    const Vector3d weight = Vector3d::Constant(0.5 * about.sum()) - about;
    const Matrix3d turn = Map<const Rows3>(s.rotation) * t.tip.rotation().transpose();
    const Matrix3d moment = weight.asDiagonal() * turn;
    spring.template tail<3>() = Vector3d(moment(2, 1) - moment(1, 2), moment(0, 2) - moment(2, 0),
                                         moment(1, 0) - moment(0, 1));
  }
  return spring +
         Vector(gains.damping).cwiseProduct(Vector(s.velocity) - velocity);
}

// As many joints as the task has dimensions: `C qd + G + H J^-1 (Xo'' - J' qd) + J^T F`.
template <int N, int D>
static Matrix<double, N, 1> square_law(const Gains &gains, const State &s, const Terms<N> &t) {
  static_assert(N == 3 && D == 3);
  const Matrix3d j = t.jacobian.template topRows<3>();
  const Vector3d velocity = j * vector<N>(s.qd);
  const Vector3d wanted = Map<const Vector3d>(s.acceleration) - t.drift.template head<3>();
  const Matrix<double, 3, 1> force = feedback<3>(gains, s, t, velocity);
  return t.nle + t.mass * (j.inverse() * wanted) + j.transpose() * force;
}

// More joints: `J^T (J H^-1 J^T)^-1` for `H J^-1`, and the damping of the null space.
template <int N, int D>
static Matrix<double, N, 1> redundant_law(const Gains &gains, const State &s, const Terms<N> &t) {
  using Task = Matrix<double, D, 1>;
  const Matrix<double, D, N> j = t.jacobian.template topRows<D>();
  const auto qd = vector<N>(s.qd);
  // With H = L L^T and Y = L^-1 J^T: J H^-1 J^T = Y^T Y, and H^-1 J^T x = L^-T Y x.
  const Eigen::LLT<Matrix<double, N, N>> factor(t.mass);
  const Matrix<double, N, D> y = factor.matrixL().solve(j.transpose());
  const Eigen::LLT<Matrix<double, D, D>> mobility(y.transpose() * y);
  const Task velocity = j * qd;
  const Task wanted = Map<const Task>(s.acceleration) - t.drift.template head<D>();
  const Matrix<double, N, 1> nullspace_velocity =
      qd - factor.matrixU().solve(y * mobility.solve(velocity));
  const Task back = y.transpose() * factor.matrixL().solve(nullspace_velocity);
  const Task through = mobility.solve(wanted + gains.nullspace * back);
  const Task force = feedback<D>(gains, s, t, velocity);
  return t.nle + j.transpose() * (through + force) - gains.nullspace * nullspace_velocity;
}

template <int N, int D> static void law(Bench &bench, const Gains &gains, const Model &model) {
  pin::Data data(model);
  const auto frame = model.getFrameId("tip");
  VectorXd q(N), qd(N);
  bench.run("law", N, [&](State &s, double *out) {
    q = vector<N>(s.q), qd = vector<N>(s.qd);
    const auto t = terms<N>(model, data, frame, q, qd);
    Map<Matrix<double, N, 1>> tau(out);
    if constexpr (N == D)
      tau = square_law<N, D>(gains, s, t);
    else
      tau = redundant_law<N, D>(gains, s, t);
  });
}

int main(int count, char **arguments) {
  if (count != 3) return 2;
  Case c(arguments[1]);
  const Model model = model_of(c);
  pin::Data data(model);
  const int n = c.joints;
  const auto frame = model.getFrameId("tip");
  const VectorXd zero = VectorXd::Zero(n);
  const auto aligned = pin::LOCAL_WORLD_ALIGNED;
  // Copied once, as a user of the library would store them.
  struct Vectors {
    VectorXd q, qd, qdd, tau;
  };
  std::vector<Vectors> vectors;
  auto dynamic = [&](const std::vector<double> &v) { return Map<const VectorXd>(v.data(), n); };
  for (State &s : c.state)
    vectors.push_back({dynamic(s.q), dynamic(s.qd), dynamic(s.qdd), dynamic(s.tau)});
  auto of = [&](State &s) -> Vectors & {
    Vectors &v = vectors[&s - c.state.data()];
    v.q[0] = s.q[0];
    return v;
  };
  Bench bench(c, arguments[2]);
  bench.run("rnea", n, [&](State &s, double *out) {
    Vectors &v = of(s);
    Map<VectorXd>(out, n) = pin::rnea(model, data, v.q, v.qd, v.qdd);
  });
  for (auto [name, convention] : {std::pair{"crba", pin::Convention::LOCAL},
                                  std::pair{"crba", pin::Convention::WORLD}})
    bench.run(name, n * n, [&, convention = convention](State &s, double *out) {
      pin::crba(model, data, of(s).q, convention);
      Map<Eigen::MatrixXd>(out, n, n) = data.M;
    });
  bench.run("aba", n, [&](State &s, double *out) {
    Vectors &v = of(s);
    Map<VectorXd>(out, n) = pin::aba(model, data, v.q, v.qd, v.tau, pin::Convention::LOCAL);
  });
  pin::Data::Matrix6x jacobian(6, n);
  jacobian.setZero();
  bench.run("jacobian", 6 * n, [&](State &s, double *out) {
    pin::computeFrameJacobian(model, data, of(s).q, frame, aligned, jacobian);
    Map<pin::Data::Matrix6x>(out, 6, n) = jacobian;
  });
  bench.run("jacobian", 6 * n, [&](State &s, double *out) {
    pin::computeJointJacobians(model, data, of(s).q);
    pin::updateFramePlacement(model, data, frame);
    pin::getFrameJacobian(model, data, frame, aligned, jacobian);
    Map<pin::Data::Matrix6x>(out, 6, n) = jacobian;
  });
  bench.run("jdot_qd", 6, [&](State &s, double *out) {
    Vectors &v = of(s);
    pin::forwardKinematics(model, data, v.q, v.qd, zero);
    pin::updateFramePlacement(model, data, frame);
    Map<Vector6>(out, 6) =
        pin::getFrameClassicalAcceleration(model, data, frame, aligned).toVector();
  });
  bench.run("regressor", 10 * n * n, [&](State &s, double *out) {
    Vectors &v = of(s);
    Map<Eigen::MatrixXd>(out, n, 10 * n) =
        pin::computeJointTorqueRegressor(model, data, v.q, v.qd, v.qdd);
  });
  if (n == 3 && c.task == 3) law<3, 3>(bench, c.gains, model);
  if (n == 4 && c.task == 3) law<4, 3>(bench, c.gains, model);
  if (n == 7 && c.task == 6) law<7, 6>(bench, c.gains, model);
}
