#include "slender_sim/scene/state_bytes.h"

#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "byte_archive.h"

namespace slender {

namespace {

template <class Archive, class Values>
void visitList(Archive& archive, Values& values)
{
  archive.list(values);
  for (auto& value : values)
    archive(value);
}

template <class Archive, class PoseType>
void visitPose(Archive& archive, PoseType& pose)
{
  archive(pose.position);
  archive(pose.orientation.coeffs());
}

template <class Archive, class State>
void visitGrasp(Archive& archive, State& grasp)
{
  archive(grasp.active);
  archive(grasp.first_node);
  archive(grasp.last_node);
  archive(grasp.holds_frame);
  archive(grasp.body);
  visitPose(archive, grasp.X_WG);
  archive(grasp.velocity.linear);
  archive(grasp.velocity.angular);
  archive.list(grasp.nodes_G);
  for (auto& node : grasp.nodes_G)
    archive(node);
  archive.list(grasp.directors_G);
  for (auto& director : grasp.directors_G)
    archive(director);
  for (int side = 0; side < 2; ++side)
  {
    archive(grasp.section_G[side]);
    archive(grasp.section_twist[side]);
  }
}

template <class Archive, class State>
void visitRod(Archive& archive, State& rod)
{
  archive(rod.x);
  archive(rod.v);
  archive(rod.d1);
  archive(rod.twist);
  archive(rod.director);
  archive.list(rod.grasps);
  for (auto& grasp : rod.grasps)
    visitGrasp(archive, grasp);
  archive(rod.last_step);
  archive(rod.next_step);
  archive(rod.a);
  archive(rod.x_previous);
  archive(rod.v_previous);
  archive(rod.strain_rate);
  archive(rod.strain_rate_previous);
  archive(rod.strain_previous);
}

template <class Archive, class State>
void visitThread(Archive& archive, State& thread)
{
  visitList(archive, thread.x);
  visitList(archive, thread.v);
  visitList(archive, thread.d1);
  visitList(archive, thread.twist);
  visitList(archive, thread.spin);
  visitList(archive, thread.volume);
  visitList(archive, thread.id);
  visitList(archive, thread.deposited);
  for (auto& end : thread.ends)
  {
    archive(end.held);
    visitPose(archive, end.X_WE);
  }
  archive(thread.next_id);
  archive(thread.thread_id);
  archive(thread.fed_volume);
  archive(thread.dropped_volume);
  archive(thread.left_volume);
}

template <class Archive, class State>
void visitThreads(Archive& archive, State& group)
{
  archive.list(group.threads);
  for (auto& thread : group.threads)
    visitThread(archive, thread);
  archive(group.next_thread_id);
  archive(group.dropped_volume);
  archive(group.left_volume);
  archive(group.start_volume);
}

template <class Archive, class State>
void visitCloth(Archive& archive, State& cloth)
{
  archive(cloth.x);
  archive(cloth.v);
  archive(cloth.rest_angles);
  archive(cloth.next_step);
  archive(cloth.stiffening);
  visitList(archive, cloth.pins);
  visitList(archive, cloth.at_bound);
  archive(cloth.average_set);
}

template <class Archive, class State>
void visitSceneCloth(Archive& archive, State& held)
{
  visitCloth(archive, held.cloth);
  archive.list(held.grasps);
  for (auto& grasp : held.grasps)
  {
    archive(grasp.active);
    visitList(archive, grasp.vertices);
    archive(grasp.points_G);
    visitPose(archive, grasp.X_WG);
  }
  archive(held.guide);
  archive(held.guide_velocity);
  archive(held.guide_forces);
  archive(held.blend.gap);
  archive(held.blend.rate);
  archive(held.blend.start);
  archive(held.blend.duration);
}

template <class Archive, class State>
void visitTwist(Archive& archive, State& twist)
{
  archive(twist.linear);
  archive(twist.angular);
}

template <class Archive, class State>
void visitBody(Archive& archive, State& body)
{
  visitPose(archive, body.X_WB);
  visitTwist(archive, body.velocity);
  archive(body.has_history);
  archive(body.linear_acceleration);
  archive(body.angular_acceleration);
  visitPose(archive, body.X_previous);
  visitTwist(archive, body.velocity_previous);
}

template <class Archive, class State>
void visitScene(Archive& archive, State& scene)
{
  archive(scene.time);
  archive(scene.steps);
  archive.list(scene.rods);
  for (auto& rod : scene.rods)
    visitRod(archive, rod);
  archive.list(scene.rod_guides);
  for (auto& guide : scene.rod_guides)
  {
    archive(guide.nodes);
    archive(guide.forces);
  }
  archive.list(scene.threads);
  for (auto& group : scene.threads)
    visitThreads(archive, group);
  archive.list(scene.cloths);
  for (auto& cloth : scene.cloths)
    visitSceneCloth(archive, cloth);
  archive.list(scene.bodies);
  for (auto& body : scene.bodies)
    visitBody(archive, body);
  archive.list(scene.obstacles);
  for (auto& pose : scene.obstacles)
    visitPose(archive, pose);
  archive.list(scene.obstacle_velocities);
  for (auto& velocity : scene.obstacle_velocities)
    visitTwist(archive, velocity);
  archive(scene.contact_stiffness);
  archive(scene.thread_contact_stiffness);
  archive.list(scene.grasp_offsets);
  for (auto& offset : scene.grasp_offsets)
    visitPose(archive, offset);
  archive.list(scene.wrenches);
  for (auto& wrench : scene.wrenches)
  {
    archive(wrench.force);
    archive(wrench.torque);
  }
  archive.list(scene.end_loads);
  for (auto& loads : scene.end_loads)
  {
    for (auto& load : loads)
    {
      archive(load.force);
      archive(load.torque);
    }
  }
}

/// Whether all numbers of a state are; visited as archives are.
class FiniteCheck
{
public:
  template <class T>
  void operator()(const T& value)
  {
    if constexpr (std::is_floating_point_v<T>)
      finite_ = finite_ && std::isfinite(value);
    else if constexpr (!std::is_arithmetic_v<T>)
      finite_ = finite_ && value.allFinite();
  }
  template <class T>
  void list(const std::vector<T>&)
  {
  }
  bool finite() const { return finite_; }

private:
  bool finite_ = true;
};

}   // namespace

std::string stateBytes(const SceneState& state)
{
  ByteWriter out;
  visitScene(out, state);
  return out.bytes();
}

std::string stateBytes(const RodState& state)
{
  ByteWriter out;
  visitRod(out, state);
  return out.bytes();
}

std::string stateBytes(const ThreadGroupState& state)
{
  ByteWriter out;
  visitThreads(out, state);
  return out.bytes();
}

std::string stateBytes(const ClothState& state)
{
  ByteWriter out;
  visitCloth(out, state);
  return out.bytes();
}

SceneState stateOfBytes(const char* bytes, std::size_t size)
{
  ByteReader reader(bytes, size);
  SceneState state;
  visitScene(reader, state);
  if (reader.left() != 0)
    throw std::runtime_error("has bytes after its end");
  FiniteCheck numbers;
  visitScene(numbers, state);
  if (!numbers.finite())
    throw std::runtime_error("holds numbers that are not finite");
  return state;
}

}   // namespace slender
