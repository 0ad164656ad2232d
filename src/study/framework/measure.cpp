#include "slender_sim/study/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "study/thread/belt_pattern.h"

namespace slender::study {

namespace {

/// Box around all nodes, and the fastest of them, at the end.
class Extents : public Measure
{
public:
  void look(const Simulation& simulation) override
  {
    box_.setEmpty();
    speed_ = 0.0;
    for (const RodState& rod : simulation.state().rods)
      for (Eigen::Index i = 0; i < rod.x.cols(); ++i)
        add(rod.x.col(i), rod.v.col(i));
    for (const ThreadGroupState& group : simulation.state().threads)
      for (const ThreadState& thread : group.threads)
        for (int i = 0; i < thread.nodes(); ++i)
          add(thread.x[i], thread.v[i]);
  }
  Row finish() const override
  {
    Row row;
    const char* const axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k)
      row.set(axes[k] + std::string("_min [m]"), box_.min()[k]).set(axes[k] + std::string("_max [m]"), box_.max()[k]);
    return row.set("speed_max [m/s]", speed_);
  }
  static std::unique_ptr<Measure> make(const SceneConfig&) { return std::make_unique<Extents>(); }

private:
  void add(const Eigen::Vector3d& x, const Eigen::Vector3d& v)
  {
    box_.extend(x);
    speed_ = std::max(speed_, v.norm());
  }
  Eigen::AlignedBox3d box_;
  double speed_ = 0.0;
};

/// Largest force and torque on a grasp.
class Loads : public Measure
{
public:
  void look(const Simulation& simulation) override
  {
    for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
    {
      const Wrench& wrench = simulation.grasps().wrench(static_cast<int>(g));
      force_ = std::max(force_, wrench.force.norm());
      torque_ = std::max(torque_, wrench.torque.norm());
    }
  }
  Row finish() const override { return Row().set("force_max [N]", force_).set("torque_max [N m]", torque_); }
  static std::unique_ptr<Measure> make(const SceneConfig& scene)
  {
    const auto holds_nothing = [](const auto& object) { return object.grasps.empty(); };
    if (std::all_of(scene.rods.begin(), scene.rods.end(), holds_nothing) &&
        std::all_of(scene.cloths.begin(), scene.cloths.end(), holds_nothing))
      throw std::invalid_argument("loads: the scene has no grasp");
    return std::make_unique<Loads>();
  }

private:
  double force_ = 0.0, torque_ = 0.0;
};

/// Pattern that the first thread draws on its belt, whose speed is that at the end.
class BeltPattern : public Measure
{
public:
  void look(const Simulation& simulation) override
  {
    const ThreadState& thread = simulation.state().threads[0].threads[0];
    belt_ = simulation.defaultInputs().threads[0].belt_velocity.x();
    if (!landings_)
      landings_ = std::make_unique<Landings>(thread);
    landings_->look(thread, simulation.state().time);
    for (int j = 0; j < thread.edges(); ++j)
      if (thread.deposited[j] && thread.deposited[j + 1])
        thinnest_ = std::min(thinnest_, thread.radius(j));
  }
  Row finish() const override
  {
    const BeltTrace t =
        classifyBeltTrace(landings_ ? landings_->points() : std::vector<Landings::Point>(), belt_, 0.5 * thinnest_);
    return Row()
        .set("pattern", t.pattern)
        .set("amplitude [m]", t.amplitude)
        .set("frequency_across [rad/s]", t.frequency_y)
        .set("frequency_along [rad/s]", t.frequency_x)
        .set("windings", t.windings)
        .set("swing [turns]", t.swing);
  }
  static std::unique_ptr<Measure> make(const SceneConfig& scene)
  {
    if (scene.threads.empty() || !scene.threads[0].floor)
      throw std::invalid_argument("belt_pattern: the scene has no thread with a floor");
    return std::make_unique<BeltPattern>();
  }

private:
  std::unique_ptr<Landings> landings_;
  double belt_ = 0.0, thinnest_ = std::numeric_limits<double>::infinity();
};

/// How far the first rod ever leaves a plane. What buckles out of it does so by a third of its width and more; ends
/// that are not quite in line bend it out by less.
class Planarity : public Measure
{
public:
  void look(const Simulation& simulation) override
  {
    const Eigen::Matrix3Xd& x = simulation.state().rods[0].x;
    const Eigen::Matrix3Xd centered = x.colwise() - x.rowwise().mean();
    const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(centered * centered.transpose())
                                       .eigenvalues()
                                       .cwiseMax(0)
                                       .cwiseSqrt();
    farthest_ = std::max(farthest_, spread[0] / spread[2]);
  }
  Row finish() const override
  {
    return Row().set("shape", farthest_ < 0.2 ? "planar" : "spatial").set("thickness_over_width", farthest_);
  }
  static std::unique_ptr<Measure> make(const SceneConfig& scene)
  {
    if (scene.rods.empty())
      throw std::invalid_argument("planarity: the scene has no rod");
    return std::make_unique<Planarity>();
  }

private:
  double farthest_ = 0.0;
};

/// Whether the first thread, held at both ends at one height, stops as a U on its way down or hangs on as a catenary
/// (thesis 5.5).
class Sagging : public Measure
{
public:
  explicit Sagging(const ThreadConfig& thread) : thread_(thread) {}

  void look(const Simulation& simulation) override
  {
    const ThreadState& s = simulation.state().threads[0].threads[0];
    const double time = simulation.state().time;
    if (distance_ == 0.0)
    {
      distance_ = (s.x[s.nodes() - 1] - s.x[0]).norm();
      middle_ = 0.5 * (s.x[0] + s.x[s.nodes() - 1]);
      speed_unit_ = thread_.density * simulation.config().gravity.norm() * distance_ * distance_ / thread_.viscosity;
    }
    const double sag = middle_.z() - heightOfMiddle(s);
    if (over_ || simulation.state().threads[0].threads.size() > 1 || sag > distance_)
      over_ = true;
    else if (time * speed_unit_ > distance_ && sag > 0.02 * distance_)   // it has got going
      slowest_ = std::min(slowest_, (sag - sag_) / (time - time_) / speed_unit_);
    if (!over_)
      sag_ = sag;
    time_ = time;
  }
  Row finish() const override
  {
    // 0.18: the lowest of a string without surface tension or inertia; a fifth of that has all but stopped
    return Row()
        .set("shape", slowest_ < 0.035 ? "U" : "catenary")
        .set("slowest", slowest_)
        .set("sag_over_distance", sag_ / distance_);
  }
  static std::unique_ptr<Measure> make(const SceneConfig& scene)
  {
    if (scene.threads.empty() || !scene.threads[0].held[0] || !scene.threads[0].held[1])
      throw std::invalid_argument("sagging: the scene's first thread is not held at both ends");
    return std::make_unique<Sagging>(scene.threads[0]);
  }

private:
  double heightOfMiddle(const ThreadState& s) const
  {
    for (int j = 0; j < s.edges(); ++j)
    {
      const double from = s.x[j].x() - middle_.x(), to = s.x[j + 1].x() - middle_.x();
      if (from <= 0 && to > 0)
        return s.x[j].z() - from / (to - from) * (s.x[j + 1].z() - s.x[j].z());
    }
    return middle_.z();
  }

  const ThreadConfig thread_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  double distance_ = 0.0, speed_unit_ = 0.0, sag_ = 0.0, time_ = 0.0,
         slowest_ = std::numeric_limits<double>::infinity();
  bool over_ = false;
};

}   // namespace

const std::vector<MeasureKind>& measureKinds()
{
  static const std::vector<MeasureKind> kinds = {
      {"extents",
       "box around all nodes and the fastest of them, at the end",
       {"x_min [m]", "x_max [m]", "y_min [m]", "y_max [m]", "z_min [m]", "z_max [m]", "speed_max [m/s]"},
       &Extents::make},
      {"loads", "largest force and torque on a grasp", {"force_max [N]", "torque_max [N m]"}, &Loads::make},
      {"belt_pattern",
       "what the first thread draws on its belt",
       {"pattern", "amplitude [m]", "frequency_across [rad/s]", "frequency_along [rad/s]", "windings", "swing [turns]"},
       &BeltPattern::make},
      {"planarity", "whether the first rod stays in a plane", {"shape", "thickness_over_width"}, &Planarity::make},
      {"sagging",
       "whether the first thread, held at both ends, stops as a U or sags on as a catenary; slowest in units of rho g "
       "L^2 / mu",
       {"shape", "slowest", "sag_over_distance"},
       &Sagging::make},
  };
  return kinds;
}

const MeasureKind* findMeasure(const std::string& name)
{
  for (const MeasureKind& kind : measureKinds())
    if (kind.name == name)
      return &kind;
  return nullptr;
}

}   // namespace slender::study
