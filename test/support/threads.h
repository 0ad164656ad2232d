#pragma once

#include <memory>

#include "slender_sim/thread/thread_model.h"
#include "slender_sim/thread/thread_stepper.h"
#include "test/support/random.h"

/// Threads that several tests share.
namespace slender::test {

inline ThreadModel honey()
{
  ThreadModel m;
  m.name = "honey";
  m.density = 1400;
  m.viscosity = 10;
  m.nozzle_diameter = 0.01;
  m.feed_length = 0.01;
  return m;
}

/// A wiggly thread of unequal edges and radii, frames turned, all of order one.
inline ThreadState wigglyThread(int n, Random& random)
{
  Eigen::Matrix3Xd x(3, n);
  Eigen::VectorXd radii(n - 1);
  for (int i = 0; i < n; ++i)
    x.col(i) = Eigen::Vector3d(i, 0, 0) + random.vector(0.3);
  for (int j = 0; j + 1 < n; ++j)
    radii[j] = random.uniform(0.15, 0.4);
  ThreadState state = makeThread(x, radii, random.direction());
  for (auto& v : state.v)
    v = random.vector();
  for (int i = 1; i + 1 < n; ++i)
  {
    const double turn = random.uniform(-0.5, 0.5);   // of all edges from i on
    state.twist[i] += turn;
    for (int j = i; j + 1 < n; ++j)
      state.d1[j] = Eigen::AngleAxisd(turn, state.edge(j).normalized()) * state.d1[j];
  }
  return state;
}

/// A nozzle at the given height that points down.
inline Pose downward(const Eigen::Vector3d& position)
{
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  return {position, Eigen::Quaterniond(axes)};
}

struct Thread
{
  ThreadModel model;
  ThreadState state;
  ThreadInputs inputs;

  static Thread fromNozzle(const ThreadModel& m, const Eigen::Vector3d& position, double speed)
  {
    Thread t{m, makeNozzleThread(m, downward(position), speed), {}};
    t.inputs.ends[1] = downward(position);
    t.inputs.flow_rate = speed * m.nozzleArea();
    return t;
  }
  ThreadStepper stepper() const { return ThreadStepper(std::make_shared<ThreadModel>(model), NewtonConfig{}); }
};

inline bool sameThread(const ThreadState& a, const ThreadState& b)
{
  return a.x == b.x && a.v == b.v && a.d1 == b.d1 && a.twist == b.twist && a.spin == b.spin && a.volume == b.volume &&
         a.id == b.id && a.deposited == b.deposited && a.next_id == b.next_id && a.fed_volume == b.fed_volume &&
         a.dropped_volume == b.dropped_volume && a.left_volume == b.left_volume &&
         a.ends[1].X_WE.position == b.ends[1].X_WE.position;
}

/// Lumped momentum over the density [m^4/s].
inline Eigen::Vector3d momentumOf(const ThreadState& s)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j < s.edges(); ++j)
    sum += 0.5 * s.volume[j] * (s.v[j] + s.v[j + 1]);
  return sum;
}

}   // namespace slender::test
