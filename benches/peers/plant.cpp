// MuJoCo steps the arm that `plant.py` describes, the tip pressed against a block by the contact law of
// supple-plant, up and down once a second: `crates/supple-plant/examples/speed.rs` with another engine.
//
//     PROGRAM arm.xml prints the real-time factor and the fraction of time in contact
#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace {

constexpr double DURATION_S = 10.0, CYCLE_S = 1e-3, TIP_RADIUS_M = 0.03;
// Hunt and Crossley along the normal, a bristle along the surface: a hard cap on wood.
constexpr double STIFFNESS = 1.4e8, DISSIPATION = 40.0, FRICTION = 0.3;
constexpr double TANGENTIAL_STIFFNESS = 2e4, TANGENTIAL_TIME_S = 1e-3;
constexpr int JOINTS = 4;

struct Contact {
  double bristle[2] = {0.0, 0.0};

  // Force on the tip at `position` with `velocity`; the block's face is z = 0.
  bool force(const double *position, const double *velocity, double dt, double *out) {
    const double depth = TIP_RADIUS_M - position[2];
    if (depth <= 0.0) {
      bristle[0] = bristle[1] = out[0] = out[1] = out[2] = 0.0;
      return false;
    }
    const double elastic = STIFFNESS * depth * std::sqrt(depth);
    const double normal = std::max(0.0, elastic * (1.0 - DISSIPATION * velocity[2]));
    const double limit = FRICTION * normal;
    for (int i = 0; i < 2; i++) bristle[i] += velocity[i] * dt;
    shorten(bristle, limit / TANGENTIAL_STIFFNESS);
    double pull[2];
    for (int i = 0; i < 2; i++)
      pull[i] = (bristle[i] + velocity[i] * TANGENTIAL_TIME_S) * TANGENTIAL_STIFFNESS;
    shorten(pull, limit);
    out[0] = -pull[0], out[1] = -pull[1], out[2] = normal;
    return true;
  }

private:
  static void shorten(double *v, double limit) {
    const double length = std::hypot(v[0], v[1]);
    if (length > limit) v[0] *= limit / length, v[1] *= limit / length;
  }
};

}  // namespace

int main(int count, char **arguments) {
  char error[1000] = "";
  mjModel *m = count == 2 ? mj_loadXML(arguments[1], nullptr, error, sizeof error) : nullptr;
  if (!m) {
    std::fprintf(stderr, "no model: %s\n", error);
    return 2;
  }
  mjData *d = mj_makeData(m);
  const int tip = mj_name2id(m, mjOBJ_SITE, "tip");
  const int last = m->site_bodyid[tip];
  d->qpos[1] = 0.9, d->qpos[3] = 1.4;
  mj_forward(m, d);

  Contact contact;
  double spent_s = 0.0;
  long touching = 0, steps = 0;
  const int steps_a_cycle = static_cast<int>(std::lround(CYCLE_S / m->opt.timestep));
  for (int cycle = 0; cycle < DURATION_S / CYCLE_S; cycle++) {
    const double target[3] = {0.72, 0.0, 0.02 + 0.05 * std::cos(2.0 * mjPI * cycle * CYCLE_S)};
    double jacobian[3 * JOINTS], torque[JOINTS], spatial[6];
    mj_jacSite(m, d, jacobian, nullptr, tip);
    mj_objectVelocity(m, d, mjOBJ_SITE, tip, spatial, 0);
    double pull[3];
    for (int i = 0; i < 3; i++)
      pull[i] = 300.0 * (target[i] - d->site_xpos[3 * tip + i]) - 20.0 * spatial[3 + i];
    for (int j = 0; j < JOINTS; j++) {
      torque[j] = d->qfrc_bias[j];
      for (int i = 0; i < 3; i++) torque[j] += jacobian[JOINTS * i + j] * pull[i];
    }
    torque[2] -= 200.0 * d->qpos[2] + 10.0 * d->qvel[2];

    const auto begin = std::chrono::steady_clock::now();
    for (int step = 0; step < steps_a_cycle; step++, steps++) {
      mj_step1(m, d);
      mj_objectVelocity(m, d, mjOBJ_SITE, tip, spatial, 0);
      const double *at = d->site_xpos + 3 * tip;
      double force[3];
      const double none[3] = {0.0, 0.0, 0.0}, point[3] = {at[0], at[1], at[2] - TIP_RADIUS_M};
      std::copy(torque, torque + JOINTS, d->qfrc_applied);
      if (contact.force(at, spatial + 3, m->opt.timestep, force)) {
        mj_applyFT(m, d, force, none, point, last, d->qfrc_applied);
        touching++;
      }
      mj_step2(m, d);
    }
    spent_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  std::printf("%.1f %.3f\n", DURATION_S / spent_s, double(touching) / steps);
}
