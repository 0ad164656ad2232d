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

/// A list of data members, in the order in which they are visited.
template <auto... members>
struct Members
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& state)
  {
    visitor(state.*members...);
  }
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

  template <class Value, std::size_t count>
  void visit(Value (&values)[count])
  {
    for (auto& entry : values)
      visit(entry);
  }

  Archive& archive_;
};

template <>
struct Fields<Eigen::Quaterniond>
{
  static constexpr bool listed = true;
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& quaternion)
  {
    visitor(quaternion.coeffs());
  }
};

template <>
struct Fields<Pose> : Members<&Pose::position, &Pose::orientation>
{
};

template <>
struct Fields<Twist> : Members<&Twist::linear, &Twist::angular>
{
};

template <>
struct Fields<Wrench> : Members<&Wrench::force, &Wrench::torque>
{
};

template <>
struct Fields<EndLoad> : Members<&EndLoad::force, &EndLoad::torque>
{
};

template <>
struct Fields<GraspState>
  : Members<&GraspState::active, &GraspState::first_node, &GraspState::last_node, &GraspState::holds_frame,
            &GraspState::body, &GraspState::X_WG, &GraspState::velocity, &GraspState::nodes_G, &GraspState::directors_G,
            &GraspState::section_G, &GraspState::section_twist>
{
};

template <>
struct Fields<RodState>
  : Members<&RodState::x, &RodState::v, &RodState::d1, &RodState::twist, &RodState::director, &RodState::spin,
            &RodState::grasps, &RodState::last_step, &RodState::next_step, &RodState::a, &RodState::x_previous,
            &RodState::v_previous, &RodState::spin_rate, &RodState::spin_previous, &RodState::turn_previous,
            &RodState::strain_rate, &RodState::strain_rate_previous, &RodState::strain_previous>
{
};

template <>
struct Fields<ThreadEnd> : Members<&ThreadEnd::held, &ThreadEnd::X_WE>
{
};

template <>
struct Fields<ThreadState>
  : Members<&ThreadState::x, &ThreadState::v, &ThreadState::d1, &ThreadState::twist, &ThreadState::spin,
            &ThreadState::volume, &ThreadState::id, &ThreadState::deposited, &ThreadState::ends, &ThreadState::next_id,
            &ThreadState::thread_id, &ThreadState::fed_volume, &ThreadState::dropped_volume, &ThreadState::left_volume>
{
};

template <>
struct Fields<ThreadGroupState>
  : Members<&ThreadGroupState::threads, &ThreadGroupState::next_thread_id, &ThreadGroupState::dropped_volume,
            &ThreadGroupState::left_volume, &ThreadGroupState::start_volume>
{
};

template <>
struct Fields<ClothState>
  : Members<&ClothState::x, &ClothState::v, &ClothState::rest_angles, &ClothState::next_step, &ClothState::stiffening,
            &ClothState::pins, &ClothState::at_bound, &ClothState::average_set>
{
};

template <>
struct Fields<ClothGrasp>
  : Members<&ClothGrasp::active, &ClothGrasp::vertices, &ClothGrasp::points_G, &ClothGrasp::X_WG>
{
};

template <>
struct Fields<FunctionBlend>
  : Members<&FunctionBlend::gap, &FunctionBlend::rate, &FunctionBlend::start, &FunctionBlend::duration>
{
};

template <>
struct Fields<GuideState> : Members<&GuideState::points, &GuideState::velocity, &GuideState::forces, &GuideState::blend>
{
};

template <>
struct Fields<RigidBodyState> : Members<&RigidBodyState::X_WB, &RigidBodyState::velocity, &RigidBodyState::last_step,
                                        &RigidBodyState::linear_acceleration, &RigidBodyState::angular_acceleration,
                                        &RigidBodyState::X_previous, &RigidBodyState::velocity_previous>
{
};

template <>
struct Fields<ContactPartner> : Members<&ContactPartner::kind, &ContactPartner::index>
{
};

template <>
struct Fields<ContactSpring>
  : Members<&ContactSpring::partner, &ContactSpring::piece, &ContactSpring::point, &ContactSpring::tension>
{
};

template <>
struct Fields<ContactRange> : Members<&ContactRange::partner, &ContactRange::share>
{
};

template <>
struct Fields<ContactMemory> : Members<&ContactMemory::stiffness, &ContactMemory::springs, &ContactMemory::ranges>
{
};

template <>
struct Fields<ContactMemories>
  : Members<&ContactMemories::rods, &ContactMemories::threads, &ContactMemories::bodies, &ContactMemories::cloths>
{
};

template <>
struct Fields<SceneState>
  : Members<&SceneState::time, &SceneState::steps, &SceneState::rods, &SceneState::rod_guides, &SceneState::threads,
            &SceneState::cloths, &SceneState::cloth_guides, &SceneState::bodies, &SceneState::obstacles,
            &SceneState::obstacle_velocities, &SceneState::contact, &SceneState::end_loads, &SceneState::cloth_grasps,
            &SceneState::grasp_offsets, &SceneState::wrenches>
{
};

}   // namespace slender
