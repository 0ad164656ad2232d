#pragma once

#include <array>
#include <type_traits>
#include <vector>

#include "slender_sim/scene/scene_state.h"

/// The fields of all states, each listed once. Saving, restoring, the check for finite numbers and comparisons visit
/// the same lists, so that they cannot drift apart. A new field of a state is added to its list here, and the version
/// in state_file.cpp is raised.
namespace slender {

/// Lists the fields of a state: visit(visitor, state) calls visitor(field, field, ...) with all of them.
template <class State>
struct Fields
{
  static constexpr bool listed = false;
};

/// Visits numbers, matrices, lists and states, down to the numbers and matrices, which `archive` takes.
template <class Archive>
class FieldVisitor
{
public:
  explicit FieldVisitor(Archive& archive) : archive_(archive) {}

  template <class... Values>
  void operator()(Values&... values)
  {
    (visit(values), ...);
  }

private:
  template <class Value>
  struct IsList : std::false_type
  {
  };
  template <class Value>
  struct IsList<std::vector<Value>> : std::true_type
  {
  };

  template <class Value>
  void visit(Value& value)
  {
    using Type = std::remove_const_t<Value>;
    if constexpr (IsList<Type>::value)
    {
      archive_.list(value);
      for (auto& entry : value)
        visit(entry);
    }
    else if constexpr (Fields<Type>::listed)
      Fields<Type>::visit(*this, value);
    else
      archive_(value);
  }
  template <class Value, std::size_t count>
  void visit(std::array<Value, count>& values)
  {
    for (auto& entry : values)
      visit(entry);
  }
  template <class Value, std::size_t count>
  void visit(const std::array<Value, count>& values)
  {
    for (const auto& entry : values)
      visit(entry);
  }

  Archive& archive_;
};

template <>
struct Fields<Pose>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& pose)
  {
    visitor(pose.position, pose.orientation.coeffs());
  }
};

template <>
struct Fields<Twist>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& twist)
  {
    visitor(twist.linear, twist.angular);
  }
};

template <>
struct Fields<Wrench>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& wrench)
  {
    visitor(wrench.force, wrench.torque);
  }
};

template <>
struct Fields<EndLoad>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& load)
  {
    visitor(load.force, load.torque);
  }
};

template <>
struct Fields<GraspState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& grasp)
  {
    visitor(grasp.active, grasp.first_node, grasp.last_node, grasp.holds_frame, grasp.body, grasp.X_WG, grasp.velocity,
            grasp.nodes_G, grasp.directors_G, grasp.section_G[0], grasp.section_G[1], grasp.section_twist[0],
            grasp.section_twist[1]);
  }
};

template <>
struct Fields<RodState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& rod)
  {
    visitor(rod.x, rod.v, rod.d1, rod.twist, rod.director, rod.grasps, rod.last_step, rod.next_step, rod.a,
            rod.x_previous, rod.v_previous, rod.strain_rate, rod.strain_rate_previous, rod.strain_previous);
  }
};

template <>
struct Fields<ThreadState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& thread)
  {
    visitor(thread.x, thread.v, thread.d1, thread.twist, thread.spin, thread.volume, thread.id, thread.deposited);
    for (auto& end : thread.ends)
      visitor(end.held, end.X_WE);
    visitor(thread.next_id, thread.thread_id, thread.fed_volume, thread.dropped_volume, thread.left_volume);
  }
};

template <>
struct Fields<ThreadGroupState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& group)
  {
    visitor(group.threads, group.next_thread_id, group.dropped_volume, group.left_volume, group.start_volume);
  }
};

template <>
struct Fields<ClothState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& cloth)
  {
    visitor(cloth.x, cloth.v, cloth.rest_angles, cloth.next_step, cloth.stiffening, cloth.pins, cloth.at_bound,
            cloth.average_set);
  }
};

template <>
struct Fields<ClothGrasp>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& grasp)
  {
    visitor(grasp.active, grasp.vertices, grasp.points_G, grasp.X_WG);
  }
};

template <>
struct Fields<GuideState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& guide)
  {
    visitor(guide.points, guide.velocity, guide.forces, guide.blend.gap, guide.blend.rate, guide.blend.start,
            guide.blend.duration);
  }
};

template <>
struct Fields<RigidBodyState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& body)
  {
    visitor(body.X_WB, body.velocity, body.has_history, body.linear_acceleration, body.angular_acceleration,
            body.X_previous, body.velocity_previous);
  }
};

template <>
struct Fields<ContactStiffness>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& stiffness)
  {
    visitor(stiffness.rods, stiffness.threads, stiffness.bodies);
  }
};

template <>
struct Fields<SceneState>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& scene)
  {
    visitor(scene.time, scene.steps, scene.rods, scene.rod_guides, scene.threads, scene.cloths, scene.cloth_guides,
            scene.bodies, scene.obstacles, scene.obstacle_velocities, scene.contact_stiffness, scene.end_loads,
            scene.cloth_grasps, scene.grasp_offsets, scene.wrenches);
  }
};

}   // namespace slender
