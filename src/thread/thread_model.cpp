#include "slender_sim/thread/thread_model.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/geometry/rotation.h"

namespace slender {

void checkThreadModel(const ThreadModel& model)
{
  const auto check = [&](bool good, const char* name, double value, const char* range) {
    if (!good)
      throw std::invalid_argument("thread '" + model.name + "': " + name + " is " + std::to_string(value) +
                                  ", allowed: " + range);
  };
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  check(positive(model.density), "density", model.density, "positive [kg/m^3]");
  check(positive(model.viscosity), "viscosity", model.viscosity, "positive [Pa s]");
  check(model.surface_tension >= 0 && std::isfinite(model.surface_tension), "surface_tension", model.surface_tension,
        "zero or more [N/m]");
  check(model.nozzle_diameter >= 0 && std::isfinite(model.nozzle_diameter), "nozzle_diameter", model.nozzle_diameter,
        "zero (no nozzle) or more [m]");
  check(model.nozzle_diameter == 0 || positive(model.feed_length), "feed_length", model.feed_length, "positive [m]");
  check(!model.floor.present || std::isfinite(model.floor.height), "floor.height", model.floor.height, "finite [m]");
  const ThreadLimits& limits = model.limits;
  check(limits.max_edge_length > 0, "limits.max_edge_length", limits.max_edge_length, "positive [m]");
  check(limits.min_edge_length >= 0 && limits.min_edge_length <= 0.4 * limits.max_edge_length, "limits.min_edge_length",
        limits.min_edge_length, "zero to 0.4 limits.max_edge_length [m]");
  check(limits.min_radius >= 0 && std::isfinite(limits.min_radius), "limits.min_radius", limits.min_radius,
        "zero or more [m]");
  check(limits.max_deposited >= 4, "limits.max_deposited", limits.max_deposited, "4 or more nodes");
}

void checkLoneThread(const ThreadModel& model)
{
  checkThreadModel(model);
  if (model.floor.slips())
    throw std::invalid_argument(
        "thread '" + model.name + "': floor.friction is " + std::to_string(model.floor.friction) +
        ", but on a floor that slips a thread needs contact: give it one, for example contact: {}");
}

ThreadState makeThread(const Eigen::Matrix3Xd& nodes, const Eigen::VectorXd& radii, const Eigen::Vector3d& director)
{
  const int n = static_cast<int>(nodes.cols());
  if (n < 2 || radii.size() != n - 1)
    throw std::invalid_argument("thread: needs two nodes or more and one radius per edge, got " + std::to_string(n) +
                                " nodes and " + std::to_string(radii.size()) + " radii");
  if (!nodes.allFinite() || !director.allFinite() || !radii.allFinite() || radii.minCoeff() <= 0)
    throw std::invalid_argument("thread: nodes and director must be finite, radii positive");
  ThreadState state;
  Eigen::Vector3d before = Eigen::Vector3d::Zero(), d1 = before;
  for (int i = 0; i < n; ++i)
  {
    state.x.push_back(nodes.col(i));
    state.v.push_back(Eigen::Vector3d::Zero());
    state.twist.push_back(0.0);
    state.id.push_back(state.next_id++);
    state.deposited.push_back(0);
    if (i == 0)
      continue;
    const Eigen::Vector3d e = nodes.col(i) - nodes.col(i - 1);
    const double length = e.norm();
    if (length == 0.0)
      throw std::invalid_argument("thread: nodes " + std::to_string(i - 1) + " and " + std::to_string(i) + " coincide");
    const Eigen::Vector3d t = e / length;
    if (i == 1)
    {
      d1 = director - t * t.dot(director);
      d1 = d1.norm() > 1e-6 * director.norm() ? Eigen::Vector3d(d1.normalized()) : anyNormal(t);
    }
    else if (1.0 + before.dot(t) < 1e-9)
      throw std::invalid_argument("thread: it folds back at node " + std::to_string(i - 1));
    else
      d1 = parallelTransport(d1, before, t);
    state.d1.push_back((d1 - t * t.dot(d1)).normalized());
    state.spin.push_back(0.0);
    state.volume.push_back(M_PI * radii[i - 1] * radii[i - 1] * length);
    before = t;
  }
  return state;
}

ThreadState makeNozzleThread(const ThreadModel& model, const Pose& X_WN, double speed)
{
  Eigen::Matrix3Xd nodes(3, 2);
  nodes.col(0) = X_WN * Eigen::Vector3d(0.5 * model.feed_length, 0, 0);
  nodes.col(1) = X_WN.position;
  ThreadState state = makeThread(nodes, Eigen::VectorXd::Constant(1, 0.5 * model.nozzle_diameter),
                                 X_WN.orientation * Eigen::Vector3d::UnitY());
  state.v[0] = state.v[1] = X_WN.orientation * Eigen::Vector3d(speed, 0, 0);
  state.ends[1] = {true, X_WN};
  return state;
}

}   // namespace slender
