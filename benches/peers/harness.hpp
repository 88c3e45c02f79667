// Shared by the benchmarks of the peers: the case file, the clock, the outputs.
//
//     PROGRAM case.txt outputs.bin     prints "function mode median_ns minimum_ns" lines
//
// A case is one arm and a pool of states as plain numbers, in the order in which `Case` reads them.
// Independent calls take the states of the pool one after the other; dependent calls wait for the previous result.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

struct State {
  std::vector<double> q, qd, qdd, tau;
  double position[3], rotation[9], velocity[6], acceleration[6];
};

struct Joint {
  double translation[3], rotation[9], axis[3], mass, com[3], inertia[9];
};

// Stiffness and damping, linear then angular, and damping of the null space.
struct Gains {
  double stiffness[6], damping[6], nullspace;
};

struct Case {
  int joints, task, states;
  double gravity[3], tip_translation[3], tip_rotation[9];
  std::vector<Joint> joint;
  Gains gains;
  std::vector<State> state;

  explicit Case(const char *path) : in(path) {
    joints = static_cast<int>(number());
    task = static_cast<int>(number());
    states = static_cast<int>(number());
    fill(gravity);
    joint.resize(joints);
    for (Joint &j : joint) {
      fill(j.translation), fill(j.rotation), fill(j.axis);
      j.mass = number();
      fill(j.com), fill(j.inertia);
    }
    fill(tip_translation), fill(tip_rotation);
    fill(gains.stiffness), fill(gains.damping);
    gains.nullspace = number();
    state.resize(states);
    for (State &s : state) {
      for (auto *v : {&s.q, &s.qd, &s.qdd, &s.tau}) {
        v->resize(joints);
        for (double &x : *v) x = number();
      }
      fill(s.position), fill(s.rotation), fill(s.velocity), fill(s.acceleration);
    }
  }

private:
  std::ifstream in;

  double number() {
    double x;
    if (!(in >> x)) {
      std::fputs("the case file ends early\n", stderr);
      std::exit(2);
    }
    return x;
  }
  template <int N> void fill(double (&values)[N]) {
    for (double &x : values) x = number();
  }
};

class Bench {
public:
  Bench(Case &c, const char *outputs) : c(c), out(outputs, std::ios::binary) {}

  // `call(state, result)` writes `size` numbers.
  template <class Call> void run(const char *name, int size, Call call) {
    std::vector<double> result(size);
    for (State &s : c.state) {
      call(s, result.data());
      out.write(reinterpret_cast<char *>(result.data()), size * sizeof(double));
    }
    time(name, "independent", [&](State &s, double) {
      call(s, result.data());
      asm volatile("" ::"r"(result.data()) : "memory");
      return 0.0;
    });
    time(name, "dependent", [&](State &s, double before) {
      // Too small to change the angle, but the compiler cannot know that.
      const double angle = s.q[0];
      s.q[0] += before * 1e-200;
      call(s, result.data());
      asm volatile("" ::"r"(result.data()) : "memory");
      s.q[0] = angle;
      return result[0];
    });
  }

private:
  static constexpr int BATCHES = 101;
  Case &c;
  std::ofstream out;

  template <class Call> void time(const char *name, const char *mode, Call call) {
    std::vector<double> ns;
    double carry = 0.0;
    for (int batch = 0; batch <= BATCHES; batch++) {
      const auto begin = std::chrono::steady_clock::now();
      for (State &s : c.state) carry = call(s, carry);
      const std::chrono::duration<double, std::nano> spent =
          std::chrono::steady_clock::now() - begin;
      if (batch > 0) ns.push_back(spent.count() / c.states);
    }
    std::sort(ns.begin(), ns.end());
    std::printf("%s %s %.3f %.3f\n", name, mode, ns[ns.size() / 2], ns[0]);
  }
};
