#pragma once

#include <limits>
#include <string>

#include <Eigen/Geometry>

#include "slender_sim/energy/surface_tension.h"
#include "slender_sim/thread/thread_state.h"

namespace slender {

/// A horizontal floor or belt. A node whose section touches it stays there (no slip) and moves with the belt; or it
/// slips, see WorldModel::Thread::contact.
struct ThreadFloor
{
  bool present = false;
  double height = 0.0;   ///< z of its surface [m]
  /// a thread lies with its centreline one radius above the surface; false: on the surface
  bool touches_at_radius = true;
  double friction = -1.0;   ///< Coulomb [-], 0: slips freely; negative: sticks

  bool slips() const { return present && friction >= 0.0; }
  bool sticks() const { return present && friction < 0.0; }
};

/// Where edges are divided, joined or taken away. The values given here switch all of it off.
struct ThreadLimits
{
  double max_edge_length = std::numeric_limits<double>::infinity();   ///< [m] longer edges are divided
  /// Above the floor edges may be longer, by this share of their height above it [-], up to `highest_edge_length` [m].
  double edge_grading = 0.0;
  double highest_edge_length = 0.0;                            ///< [m] without effect below max_edge_length
  double max_step = std::numeric_limits<double>::infinity();   ///< [s] longer steps are taken in several
  double min_edge_length = 0.0;                                ///< [m] shorter edges are joined to a neighbour
  /// [m] a thinner edge breaks: see breakThreads()
  double min_radius = 0.0;
  /// nodes older than the youngest one on the floor; more are dropped
  int max_deposited = std::numeric_limits<int>::max();
  /// The old end is dropped outside of it.
  Eigen::AlignedBox3d scene{Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity()),
                            Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity())};
};

struct Fluid
{
  double density = 1000.0;        ///< [kg/m^3]
  double viscosity = 1.0;         ///< dynamic, mu [Pa s]
  double surface_tension = 0.0;   ///< gamma [N/m]
};

/// Fixed properties of one viscous thread (thesis 5).
struct ThreadModel : Fluid
{
  std::string name;
  SurfaceShape surface_shape = SurfaceShape::cone;
  double nozzle_diameter = 0.0;   ///< [m]; 0: no nozzle
  double feed_length = 0.0;       ///< [m] of the edges that leave the nozzle
  ThreadFloor floor;
  ThreadLimits limits;

  double nozzleArea() const { return 0.25 * M_PI * nozzle_diameter * nozzle_diameter; }
};

/// Throws std::invalid_argument naming the bad value.
void checkThreadModel(const ThreadModel& model);
/// The same for a thread without contact, whose floor must not slip.
void checkLoneThread(const ThreadModel& model);

/// A thread at rest through `nodes` (3 x n, n >= 2, from the oldest to the newest [m]) with edge radii [m] (n-1),
/// twist-free frames from `director` (zero: any normal). Ends are free. Throws std::invalid_argument naming the bad
/// value.
ThreadState makeThread(const Eigen::Matrix3Xd& nodes, const Eigen::VectorXd& radii,
                       const Eigen::Vector3d& director = Eigen::Vector3d::Zero());

/// The stub of a thread that begins to leave a nozzle: half an edge of fluid below it, moving at `speed` [m/s].
ThreadState makeNozzleThread(const ThreadModel& model, const Pose& X_WN, double speed);

}   // namespace slender
