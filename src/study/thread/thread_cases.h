#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/study/study.h"
#include "slender_sim/thread/thread_stepper.h"

namespace slender::study {

/// The oil of the thesis's threads that sag between plates, CGS units.
struct ThesisOil
{
  static constexpr double density = 0.907, viscosity = 100.0, surface_tension = 20.0, gravity = 981.0;
};

/// Model, state and inputs of one thread that belong together. Units are those of the case (CGS in most references).
struct ThreadSetup
{
  ThreadModel model;
  ThreadState state;
  ThreadInputs inputs;
  double time = 0.0;

  /// Fixes an end (0: oldest, 1: newest) where it is, its section across the edge there.
  void hold(int end);
  double length() const;
};

/// A straight thread along x from the origin with the given edge radii, at rest, no gravity, ends free.
ThreadSetup straightThread(double length, const Eigen::VectorXd& radii);

/// A nozzle at `position` that points down, with the stub of a thread; its flow starts with the first step.
ThreadSetup nozzleThread(const ThreadModel& model, const Eigen::Vector3d& position, double speed);

/// Where nodes land, one after the other, and when.
class Landings
{
public:
  struct Point
  {
    double time, x, y;
  };
  /// Nodes that lie on the floor already do not count.
  explicit Landings(const ThreadState& s);
  /// After every step.
  void look(const ThreadState& s, double time);
  const std::vector<Point>& points() const { return points_; }

private:
  std::uint64_t last_;
  std::vector<Point> points_;
};

ThreadStepper makeStepper(const ThreadSetup& thread);

/// One step; throws std::runtime_error with `what` and the report's message unless it was done.
void advance(ThreadStepper& stepper, ThreadSetup& thread, double h, const std::string& what);

/// Adds a row that checks `measured` within `relative` of `expected`.
Row& checkRelative(StudyContext& context, const std::string& test, const std::string& quantity, double measured,
                   double expected, double relative, const std::string& source);

}   // namespace slender::study
