// The C that `symbolic.py` writes for one arm; ARM_C names it. Compiled as C++ in one piece with the
// calls, with the flags of the other peer.
#include "harness.hpp"

#include ARM_C

// Such a function takes pointers to its inputs and results and needs no other memory.
template <class Function>
static void call(Function function, std::initializer_list<const double *> inputs, double *out) {
  const double *arguments[8];
  std::copy(inputs.begin(), inputs.end(), arguments);
  double *results[1] = {out};
  function(arguments, results, nullptr, nullptr, 0);
}

int main(int count, char **arguments) {
  if (count != 3) return 2;
  Case c(arguments[1]);
  const int n = c.joints;
  Bench bench(c, arguments[2]);
  bench.run("rnea", n, [](State &s, double *out) {
    call(rnea, {s.q.data(), s.qd.data(), s.qdd.data()}, out);
  });
  bench.run("crba", n * n, [](State &s, double *out) { call(crba, {s.q.data()}, out); });
  bench.run("aba", n, [](State &s, double *out) {
    call(aba, {s.q.data(), s.qd.data(), s.tau.data()}, out);
  });
  bench.run("jacobian", 6 * n,
            [](State &s, double *out) { call(jacobian, {s.q.data()}, out); });
  bench.run("jdot_qd", 6, [](State &s, double *out) {
    call(jdot_qd, {s.q.data(), s.qd.data()}, out);
  });
  bench.run("regressor", 10 * n * n, [](State &s, double *out) {
    call(regressor, {s.q.data(), s.qd.data(), s.qdd.data()}, out);
  });
  bench.run("law", n, [](State &s, double *out) {
    call(law,
                   {s.q.data(), s.qd.data(), s.position, s.rotation, s.velocity, s.acceleration},
                   out);
  });
}
