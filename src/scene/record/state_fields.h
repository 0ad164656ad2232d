#pragma once

#include <array>
#include <type_traits>
#include <vector>

#include "slender_sim/scene/scene_state.h"

/// The fields of all states, each listed once, in the type that fieldsOf() would return. Saving, restoring, the check
/// for finite numbers and comparisons visit the same lists, so that they cannot drift apart. A new field of a state is
/// added to its list here, and the version in state_file.cpp is raised.
namespace slender {

/// A list of data members, in the order in which they are visited.
template <auto... members>
struct Members
{
  template <class Visitor, class State>
  static void visit(Visitor& visitor, State& state)
  {
    visitor(state.*members...);
  }
};

auto fieldsOf(const Pose&) -> Members<&Pose::position, &Pose::orientation>;
auto fieldsOf(const Twist&) -> Members<&Twist::linear, &Twist::angular>;
auto fieldsOf(const Wrench&) -> Members<&Wrench::force, &Wrench::torque>;
auto fieldsOf(const GraspState&)
    -> Members<&GraspState::active, &GraspState::first_node, &GraspState::last_node, &GraspState::holds_frame,
               &GraspState::body, &GraspState::X_WG, &GraspState::velocity, &GraspState::nodes_G,
               &GraspState::directors_G, &GraspState::section_G, &GraspState::section_twist>;
auto fieldsOf(const RodState&)
    -> Members<&RodState::x, &RodState::v, &RodState::d1, &RodState::twist, &RodState::director, &RodState::spin,
               &RodState::grasps, &RodState::last_step, &RodState::next_step, &RodState::a, &RodState::x_previous,
               &RodState::v_previous, &RodState::spin_rate, &RodState::spin_previous, &RodState::turn_previous,
               &RodState::strain_rate, &RodState::strain_rate_previous, &RodState::strain_previous>;
auto fieldsOf(const ThreadEnd&) -> Members<&ThreadEnd::held, &ThreadEnd::X_WE>;
auto fieldsOf(const ThreadState&)
    -> Members<&ThreadState::x, &ThreadState::v, &ThreadState::d1, &ThreadState::twist, &ThreadState::spin,
               &ThreadState::volume, &ThreadState::id, &ThreadState::deposited, &ThreadState::ends,
               &ThreadState::next_id, &ThreadState::thread_id, &ThreadState::fed_volume, &ThreadState::dropped_volume,
               &ThreadState::left_volume>;
auto fieldsOf(const ThreadGroupState&)
    -> Members<&ThreadGroupState::threads, &ThreadGroupState::next_thread_id, &ThreadGroupState::dropped_volume,
               &ThreadGroupState::left_volume, &ThreadGroupState::start_volume>;
auto fieldsOf(const ClothState&)
    -> Members<&ClothState::x, &ClothState::v, &ClothState::rest_angles, &ClothState::next_step,
               &ClothState::stiffening, &ClothState::pins, &ClothState::at_bound, &ClothState::average_set>;
auto fieldsOf(const ClothGrasp&)
    -> Members<&ClothGrasp::active, &ClothGrasp::vertices, &ClothGrasp::points_G, &ClothGrasp::X_WG>;
auto fieldsOf(const FunctionBlend&)
    -> Members<&FunctionBlend::gap, &FunctionBlend::rate, &FunctionBlend::start, &FunctionBlend::duration>;
auto fieldsOf(const GuideState&)
    -> Members<&GuideState::points, &GuideState::velocity, &GuideState::forces, &GuideState::blend>;
auto fieldsOf(const RigidBodyState&)
    -> Members<&RigidBodyState::X_WB, &RigidBodyState::velocity, &RigidBodyState::last_step,
               &RigidBodyState::linear_acceleration, &RigidBodyState::angular_acceleration, &RigidBodyState::X_previous,
               &RigidBodyState::velocity_previous>;
auto fieldsOf(const ObjectRef&) -> Members<&ObjectRef::kind, &ObjectRef::index>;
auto fieldsOf(const ContactSpring&)
    -> Members<&ContactSpring::partner, &ContactSpring::piece, &ContactSpring::point, &ContactSpring::tension>;
auto fieldsOf(const BarrierLayer&) -> Members<&BarrierLayer::share, &BarrierLayer::stiffness>;
auto fieldsOf(const BarrierLaw&) -> Members<&BarrierLaw::layers>;
auto fieldsOf(const ContactRange&) -> Members<&ContactRange::partner, &ContactRange::share>;
auto fieldsOf(const ContactMemory&)
    -> Members<&ContactMemory::barrier, &ContactMemory::springs, &ContactMemory::ranges>;
auto fieldsOf(const ContactMemories&)
    -> Members<&ContactMemories::rods, &ContactMemories::threads, &ContactMemories::bodies, &ContactMemories::cloths>;
auto fieldsOf(const SceneState&)
    -> Members<&SceneState::time, &SceneState::steps, &SceneState::rods, &SceneState::rod_guides, &SceneState::threads,
               &SceneState::cloths, &SceneState::cloth_guides, &SceneState::bodies, &SceneState::obstacles,
               &SceneState::obstacle_velocities, &SceneState::contact, &SceneState::end_loads,
               &SceneState::cloth_grasps, &SceneState::grasp_offsets, &SceneState::wrenches>;
void fieldsOf(...);   // of what is no state

enum class ListKind
{
  none,
  fixed,   ///< of a size that the type says
  dynamic
};
template <class Value>
constexpr ListKind list_kind = std::is_array_v<Value> ? ListKind::fixed : ListKind::none;
template <class Value, std::size_t count>
constexpr ListKind list_kind<std::array<Value, count>> = ListKind::fixed;
template <class Value>
constexpr ListKind list_kind<std::vector<Value>> = ListKind::dynamic;

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
  void visit(Value& value)
  {
    using Type = std::remove_const_t<Value>;
    using Listed = decltype(fieldsOf(value));
    if constexpr (list_kind<Type> == ListKind::dynamic)
      archive_.list(value);
    if constexpr (list_kind<Type> != ListKind::none)
      for (auto& entry : value)
        visit(entry);
    else if constexpr (!std::is_void_v<Listed>)
      Listed::visit(*this, value);
    else if constexpr (std::is_same_v<Type, Eigen::Quaterniond>)
      archive_(value.coeffs());
    else
      archive_(value);
  }

  Archive& archive_;
};

}   // namespace slender
