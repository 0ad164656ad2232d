#pragma once

#include <optional>

#include "contact/contact_potential.h"
#include "slender_sim/world/world.h"
#include "test/support/rods.h"

namespace slender::test {

inline ContactProperties impulseContact(double thickness = 1e-3)
{
  ContactProperties contact;
  contact.thickness = thickness;
  contact.method = ContactMethod::impulses;
  return contact;
}

/// Rods, cloths, bodies and obstacles under construction, with inputs that hold everything held where it is: the model
/// of a world, its state and its inputs, without a scene.
struct Group
{
  WorldModel model;
  WorldState state;
  WorldInputs inputs;

  int addRod(const Rod& rod)
  {
    model.rods.push_back({rod.model, {}, {}});
    state.rods.push_back(rod.state);
    inputs.rods.push_back(rod.inputs);
    inputs.gravity = rod.inputs.gravity;
    return static_cast<int>(model.rods.size()) - 1;
  }
  int addCloth(const std::shared_ptr<const ClothModel>& cloth, const ClothState& start,
               const ClothOptions& options = {}, const ContactProperties& contact = impulseContact(),
               const ClothInputs& input = {})
  {
    model.cloths.push_back({cloth, options, contact, {}, {}});
    state.cloths.push_back(start);
    inputs.cloths.push_back(input);
    return static_cast<int>(model.cloths.size()) - 1;
  }
  int addBody(const RigidBodyModel& body, const Pose& pose, const Twist& velocity = {})
  {
    model.bodies.push_back({body, {}, {}, -1.0});
    RigidBodyState s;
    s.X_WB = pose;
    s.velocity = velocity;
    state.bodies.push_back(s);
    inputs.bodies.push_back({pose, std::nullopt});
    return static_cast<int>(model.bodies.size()) - 1;
  }
  int addObstacle(const Shape& shape, const Pose& pose, double friction = -1.0)
  {
    model.obstacles.push_back({shape, friction, "obstacle"});
    state.obstacles.push_back(pose);
    state.obstacle_velocities.push_back({});
    inputs.obstacles.push_back({pose, std::nullopt});
    return static_cast<int>(model.obstacles.size()) - 1;
  }
  void weld(int rod, int first, int last, int body)
  {
    model.welds.push_back({rod, first, last, body});
    inputs.rods[rod].grasps.emplace_back();
  }
  /// A world of this that takes steps of `step` [s]. With the first one the state gets the grasps of the welds. Others
  /// are made from the same start and take the present state as it is.
  World world(const TimeConfig& time, double step)
  {
    model.time = time;
    model.time.step = step;
    if (start_)
    {
      WorldState again = *start_;
      return World(model, again);
    }
    start_ = state;
    return World(model, state);
  }
  void setGravity(const Vector3d& g)
  {
    inputs.gravity = g;
    for (RodInputs& rod : inputs.rods)
      rod.gravity = g;
  }
  Vector3d momentum() const
  {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t r = 0; r < model.rods.size(); ++r)
      sum += state.rods[r].v * model.rods[r].model->mass;
    for (std::size_t b = 0; b < model.bodies.size(); ++b)
      sum += model.bodies[b].body.mass * state.bodies[b].velocity.linear;
    return sum;
  }
  Vector3d angularMomentum() const
  {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t r = 0; r < model.rods.size(); ++r)
      for (int i = 0; i < model.rods[r].model->nodes(); ++i)
        sum += model.rods[r].model->mass[i] * state.rods[r].x.col(i).cross(state.rods[r].v.col(i));
    for (std::size_t b = 0; b < model.bodies.size(); ++b)
    {
      const RigidBodyState& s = state.bodies[b];
      const Eigen::Matrix3d r = s.X_WB.orientation.toRotationMatrix();
      sum += model.bodies[b].body.mass * s.X_WB.position.cross(s.velocity.linear) +
             r * model.bodies[b].body.inertia * r.transpose() * s.velocity.angular;
    }
    return sum;
  }

private:
  std::optional<WorldState> start_;   ///< of its first world
};

/// Smallest distance between surfaces that may touch [m], up to the gap at which they repel.
inline double clearance(const Group& g)
{
  ContactSurface surface;
  Matrix3Xd points(3, 0);
  for (std::size_t r = 0; r < g.model.rods.size(); ++r)
  {
    const auto& contact = g.model.rods[r].contact;
    if (!contact)
      continue;
    const RodModel& m = *g.model.rods[r].model;
    const int object = static_cast<int>(surface.objects.size());
    double start = 0.0;
    for (int j = 0; j < m.edges(); ++j)
    {
      ContactSegment s;
      s.a = surface.points + j;
      s.b = surface.points + (j + 1) % m.nodes();
      s.radius = std::max(m.radius_a[j], m.radius_b[j]);
      s.object = object;
      s.start = start;
      s.length = m.rest_length[j];
      start += s.length;
      surface.segments.push_back(s);
    }
    surface.objects.push_back({*contact, start, m.closed, -1});
    surface.points += m.nodes();
    points.conservativeResize(3, surface.points);
    points.rightCols(m.nodes()) = g.state.rods[r].x;
  }
  std::vector<Pose> solids = g.state.obstacles;
  for (const Obstacle& obstacle : g.model.obstacles)
    surface.solids.push_back({obstacle});
  for (std::size_t b = 0; b < g.model.bodies.size(); ++b)
    if (const WorldModel::Body& body = g.model.bodies[b]; body.shape)
    {
      surface.solids.push_back({body.solid()});
      solids.push_back(g.state.bodies[b].X_WB * body.X_BS);
    }
  return ContactPotential(surface, g.model.contact).clearance(points, solids);
}

inline RigidBodyModel bodyOf(double mass, const Vector3d& principal)
{
  RigidBodyModel body;
  body.name = "body";
  body.mass = mass;
  body.inertia = principal.asDiagonal();
  return body;
}

/// A T of three rods on one body, spinning and bending freely.
inline Group tee()
{
  Group g;
  const RodSection section = modulusSection(0.02, 0.015, 50.0, 0.05);
  const Vector3d ends[] = {{0.3, 0, 0}, {-0.3, 0.02, 0}, {0.01, 0.1, 0.25}};
  Twist spin;
  spin.linear << 0.1, -0.2, 0.3;
  spin.angular << 1.0, 2.0, 3.0;
  const int body = g.addBody(bodyOf(0.02, {2e-5, 3e-5, 4e-5}),
                             {Vector3d(0.002, 0.001, 0), Eigen::Quaterniond(0.9, 0.1, 0.2, 0.3).normalized()}, spin);
  int inner = 0;
  for (const Vector3d& end : ends)
  {
    const int n = 9;
    Matrix3Xd nodes(3, n);
    for (int i = 0; i < n; ++i)
      nodes.col(i) = end * (i + 0.1) / n;
    Rod rod(openRod(nodes, section), nodes);
    const int r = g.addRod(rod);
    inner == 2 ? g.weld(r, 3, 4, body) : g.weld(r, 0, 0, body);   // the third by an edge inside it
    ++inner;
    for (int i = 0; i < n; ++i)
      g.state.rods[r].v.col(i) = spin.linear + spin.angular.cross(nodes.col(i) - g.state.bodies[0].X_WB.position);
  }
  g.setGravity(Vector3d::Zero());
  return g;
}

}   // namespace slender::test
