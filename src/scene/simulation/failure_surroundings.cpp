#include "failure_text.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

using Kind = FailurePlace::Kind;

struct Nearest
{
  double distance = std::numeric_limits<double>::infinity();   ///< [m]
  std::string name;

  void add(double other, const std::string& other_name)
  {
    if (other < distance)
    {
      distance = other;
      name = other_name;
    }
  }
  std::string text(const std::string& what) const
  {
    return name.empty() ? "" : "; the nearest " + what + " is " + name + ", " + shortNumber(distance, 3) + " m away";
  }
};

template <class Configs>
int indexOf(const Configs& configs, const std::string& name)
{
  const auto found =
      std::find_if(configs.begin(), configs.end(), [&name](const auto& config) { return config.name == name; });
  return found == configs.end() ? -1 : static_cast<int>(found - configs.begin());
}

std::string quoted(const char* kind, const std::string& name) { return std::string(kind) + " '" + name + "'"; }

/// Looks at one object of a simulation from one of its nodes.
class Surroundings
{
public:
  Surroundings(const Simulation& simulation, const FailurePlace& place)
    : simulation_(simulation),
      config_(simulation.config()),
      place_(place)
  {
    object_ = place.kind == Kind::rod      ? indexOf(config_.rods, place.name)
              : place.kind == Kind::thread ? indexOf(config_.threads, place.name)
                                           : indexOf(config_.cloths, place.name);
    meets_all_ = place.kind != Kind::cloth || (object_ >= 0 && takesBarrier(object_));
  }

  std::string text()
  {
    if (place_.kind == Kind::none || object_ < 0 || !place_.position.allFinite())
      return "";
    findHolder();
    if (place_.kind == Kind::rod)
    {
      const RodModel& model = simulation_.rodModel(object_);
      findPartners(config_.rods[object_].contact, largestRadius(model, std::min(place_.node, model.edges() - 1)));
    }
    else if (place_.kind == Kind::thread)
    {
      const double radius = radiusOfThread();
      if (const auto& floor = config_.threads[object_].floor)
        partner_.add(place_.position.z() - floor->height - radius, "the floor");
      findPartners(config_.threads[object_].contact, radius);
    }
    else
    {
      findPartners(config_.cloths[object_].contact, 0.0);
    }
    return holder_.text("grasp") + partner_.text("contact partner");
  }

private:
  void findHolder()
  {
    const SceneState& state = simulation_.state();
    for (std::size_t g = 0; g < simulation_.grasps().size(); ++g)
    {
      const GraspRef& ref = simulation_.grasps()[g];
      const bool same_kind = place_.kind == (ref.object.isCloth() ? Kind::cloth : Kind::rod);
      if (!simulation_.grasps().isActive(static_cast<int>(g)) || !same_kind || ref.object.index != object_)
        continue;
      const std::string name = "'" + ref.config->name + "'";
      if (place_.kind == Kind::rod)
      {
        const GraspState& held = state.rods[object_].grasps[ref.index];
        holder_.add(toNodes(object_, held.first_node, held.last_node), name);
      }
      else
      {
        for (const int vertex : state.cloth_grasps[object_][ref.index].vertices)
          holder_.add((state.cloths[object_].x.col(vertex) - place_.position).norm(), name);
      }
    }
    for (const BodyConfig& body : config_.bodies)
      for (const WeldConfig& weld : body.welds)
        if (place_.kind == Kind::rod && weld.rod == object_)
          holder_.add(toNodes(object_, weld.first_node, weld.last_node), "the weld to " + quoted("body", body.name));
    if (place_.kind != Kind::thread)
      return;
    for (const ThreadState& thread : state.threads[object_].threads)
      for (int end = 0; end < 2; ++end)
        if (thread.ends[end].held)
        {
          holder_.add(((end ? thread.x.back() : thread.x.front()) - place_.position).norm(),
                      config_.threads[object_].nozzle ? "the nozzle" : "a held end");
        }
  }

  double toNodes(int rod, int first, int last) const
  {
    const Eigen::Matrix3Xd& x = simulation_.state().rods[rod].x;
    return (x.middleCols(first, last - first + 1).colwise() - place_.position).colwise().norm().minCoeff();
  }

  /// `radius`: of the object at the place [m].
  void findPartners(const std::optional<ContactProperties>& contact, double radius)
  {
    if (!contact)
      return;
    if (contact->solids)
      addSolids(radius);
    const auto meets = [&](Kind kind, int index, const std::optional<ContactProperties>& other) {
      return kind == place_.kind && index == object_ ? kind == Kind::rod && contact->self
                                                     : contact->others && other && other->others;
    };
    for (int r = 0; meets_all_ && r < static_cast<int>(config_.rods.size()); ++r)
      if (meets(Kind::rod, r, config_.rods[r].contact))
        addRod(r, radius);
    for (int k = 0; meets_all_ && k < static_cast<int>(config_.threads.size()); ++k)
      if (meets(Kind::thread, k, config_.threads[k].contact))
        addThread(k, radius);
    for (int k = 0; k < static_cast<int>(config_.cloths.size()); ++k)
      if ((place_.kind == Kind::cloth || takesBarrier(k)) && meets(Kind::cloth, k, config_.cloths[k].contact))
        addCloth(k);
  }

  /// Rods pass through the bodies that they are welded to, and cloth with impulses meets driven bodies only.
  bool touches(const BodyConfig& body) const
  {
    return place_.kind == Kind::rod ? !body.isWeldedTo(object_) : meets_all_ || body.motion;
  }
  bool takesBarrier(int cloth) const
  {
    const auto& contact = config_.cloths[cloth].contact;
    return contact && contact->method == ContactMethod::barrier;
  }

  void addSolids(double radius)
  {
    const SceneState& state = simulation_.state();
    for (std::size_t k = 0; k < config_.obstacles.size(); ++k)
      addSolid(config_.obstacles[k].shape, state.obstacles[k], radius, quoted("obstacle", config_.obstacles[k].name));
    for (std::size_t b = 0; b < config_.bodies.size(); ++b)
    {
      const BodyConfig& body = config_.bodies[b];
      if (body.isSolid() && touches(body))
        addSolid(*body.shape, state.bodies[b].X_WB * body.X_BS, radius, quoted("body", body.name));
    }
  }

  void addSolid(const Shape& shape, const Pose& pose, double radius, const std::string& name)
  {
    partner_.add(distanceToShape(shape, pose, place_.position, place_.position) - radius, name);
  }

  void addSegment(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radii, const std::string& name)
  {
    partner_.add(pointSegmentDistance(place_.position, a, b) - radii, name);
  }

  void addRod(int r, double radius)
  {
    const bool own = place_.kind == Kind::rod && r == object_;
    const RodModel& other = simulation_.rodModel(r);
    const Eigen::Matrix3Xd& x = simulation_.state().rods[r].x;
    for (int j = 0; j < other.edges(); ++j)
    {
      const double radii = radius + largestRadius(other, j);
      const Eigen::Vector3d a = x.col(j), b = x.col((j + 1) % other.nodes());
      if (!own || comesBack(other, j, radii, pointSegmentDistance(place_.position, a, b)))
        addSegment(a, b, radii,
                   own ? "the rod itself at edge " + std::to_string(j) : quoted("rod", config_.rods[r].name));
    }
  }

  void addThread(int k, double radius)
  {
    for (const ThreadState& thread : simulation_.state().threads[k].threads)
      for (int j = 0; j < thread.edges(); ++j)
        addSegment(thread.x[j], thread.x[j + 1], radius + thread.radius(j), quoted("thread", config_.threads[k].name));
  }

  void addCloth(int k)
  {
    const Eigen::Matrix3Xi& faces = config_.cloths[k].mesh.triangles;
    const Eigen::Matrix3Xd& x = simulation_.state().cloths[k].x;
    for (Eigen::Index f = 0; f < faces.cols(); ++f)
    {
      partner_.add(pointTriangleDistance(place_.position, x.col(faces(0, f)), x.col(faces(1, f)), x.col(faces(2, f))),
                   quoted("cloth", config_.cloths[k].name));
    }
  }

  static double largestRadius(const RodModel& model, int edge)
  {
    return std::max(model.radius_a[edge], model.radius_b[edge]);
  }

  /// Returns true if an edge of the same rod is near because the rod returns to this place, and not because the edge is
  /// a neighbour: it keeps its whole thickness (see contactShare()), and the distance along the rod is at least twice
  /// the distance in space.
  bool comesBack(const RodModel& model, int edge, double radii, double distance) const
  {
    const auto between = [&model](int from, int to) {
      return from < to ? model.rest_length.segment(from, to - from).sum() : 0.0;
    };
    double along = edge >= place_.node ? between(place_.node, edge) : between(edge + 1, place_.node);
    if (model.closed)
      along = std::min(along, model.rest_length.sum() - along - model.rest_length[edge]);
    return along > 0.5 * M_PI * (radii + config_.contact.gap) && along > 2.0 * distance;
  }

  /// Where the place is [m].
  double radiusOfThread() const
  {
    double radius = 0.0, nearest = std::numeric_limits<double>::infinity();
    for (const ThreadState& thread : simulation_.state().threads[object_].threads)
    {
      for (int j = 0; j < thread.edges(); ++j)
      {
        if (const double distance = (thread.x[j] - place_.position).norm(); distance < nearest)
        {
          nearest = distance;
          radius = thread.radius(j);
        }
      }
    }
    return radius;
  }

  const Simulation& simulation_;
  const SceneConfig& config_;
  const FailurePlace& place_;
  int object_ = -1;
  bool meets_all_ = true;   ///< false for cloth with impulses
  Nearest holder_, partner_;
};

}   // namespace

std::string surroundingsOf(const Simulation& simulation, const FailurePlace& place)
{
  return Surroundings(simulation, place).text();
}

}   // namespace slender
