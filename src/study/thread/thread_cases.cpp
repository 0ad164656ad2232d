#include "thread_cases.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/thread/thread_model.h"

namespace slender::study {

void ThreadSetup::hold(int end)
{
  const Eigen::Vector3d t = (end ? -1.0 : 1.0) * state.edge(end ? state.edges() - 1 : 0).normalized();
  const Eigen::Vector3d d1 = end ? state.d1.back() : state.d1.front();
  Eigen::Matrix3d section;
  section << t, d1, t.cross(d1);
  state.ends[end] = {true, {end ? state.x.back() : state.x.front(), Eigen::Quaterniond(section).normalized()}};
  inputs.ends[end] = state.ends[end].X_WE;
}

double ThreadSetup::length() const
{
  double sum = 0.0;
  for (int j = 0; j < state.edges(); ++j)
    sum += state.edge(j).norm();
  return sum;
}

ThreadSetup straightThread(double length, const Eigen::VectorXd& radii)
{
  ThreadSetup t;
  const int n = static_cast<int>(radii.size()) + 1;
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, n);
  nodes.row(0) = Eigen::RowVectorXd::LinSpaced(n, 0.0, length);
  t.model.name = "thread";
  t.state = makeThread(nodes, radii, Eigen::Vector3d::UnitY());
  t.inputs.gravity.setZero();
  return t;
}

ThreadSetup nozzleThread(const ThreadModel& model, const Eigen::Vector3d& position, double speed)
{
  ThreadSetup t;
  t.model = model;
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  const Pose nozzle{position, Eigen::Quaterniond(axes)};
  t.state = makeNozzleThread(model, nozzle, speed);
  t.inputs.ends[1] = nozzle;
  t.inputs.flow_rate = speed * model.nozzleArea();
  return t;
}

namespace {

int youngestOnFloor(const ThreadState& s)
{
  int i = s.nodes() - 1;
  while (i >= 0 && !s.deposited[i])
    --i;
  return i;
}

}   // namespace

Landings::Landings(const ThreadState& s) : last_(youngestOnFloor(s) < 0 ? s.next_id : s.id[youngestOnFloor(s)]) {}

void Landings::look(const ThreadState& s, double time)
{
  const int i = youngestOnFloor(s);
  if (i < 0 || s.id[i] == last_)
    return;
  last_ = s.id[i];
  points_.push_back({time, s.x[i].x(), s.x[i].y()});
}

ThreadStepper makeStepper(const ThreadSetup& thread)
{
  NewtonConfig newton;
  newton.tolerance = 1e-7;
  return ThreadStepper(std::make_shared<ThreadModel>(thread.model), newton);
}

void advance(ThreadStepper& stepper, ThreadSetup& thread, double h, const std::string& what)
{
  const StepReport report = stepper.step(thread.state, thread.inputs, h);
  if (!report.ok)
    throw std::runtime_error(what + " at t = " + std::to_string(thread.time) + ": " + report.message);
  thread.time += h;
}

Row& checkRelative(StudyContext& context, const std::string& test, const std::string& quantity, double measured,
                   double expected, double relative, const std::string& source)
{
  Row& row = context.row();
  row.set("test", test).set("quantity", quantity);
  row.check(measured, expected, relative * std::abs(expected), source).set("relative_error", measured / expected - 1);
  return row;
}

}   // namespace slender::study
