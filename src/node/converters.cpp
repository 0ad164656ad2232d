#include "slender_sim/node/converters.h"

#include <algorithm>

#include <array>
#include <cmath>
#include <cstring>

#include <sensor_msgs/point_cloud2_iterator.h>

namespace slender {

geometry_msgs::Point toPoint(const Eigen::Vector3d& p)
{
  geometry_msgs::Point out;
  out.x = p.x();
  out.y = p.y();
  out.z = p.z();
  return out;
}

std::string fromPoints(const sensor_msgs::PointCloud2& message, Eigen::Matrix3Xd& out)
{
  if (message.is_bigendian)
    return "is_bigendian must be false";
  std::array<const sensor_msgs::PointField*, 3> fields{};
  for (const sensor_msgs::PointField& field : message.fields)
    for (int k = 0; k < 3; ++k)
      if (field.name == std::string(1, "xyz"[k]))
        fields[k] = &field;
  for (const auto* field : fields)
  {
    if (!field || field->count != 1 ||
        (field->datatype != sensor_msgs::PointField::FLOAT32 && field->datatype != sensor_msgs::PointField::FLOAT64))
      return "it must have the fields x, y and z, float32 or float64";
    if (std::uint64_t{field->offset} + (field->datatype == sensor_msgs::PointField::FLOAT32 ? 4 : 8) >
        message.point_step)   // 32 bits wrap
      return "a field reaches beyond point_step";
  }
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  if (message.row_step < row || message.data.size() < std::uint64_t{message.height} * message.row_step)
    return "data is shorter than width, height and steps say";
  out.resize(3, static_cast<Eigen::Index>(message.width) * message.height);
  for (Eigen::Index i = 0; i < out.cols(); ++i)
  {
    const std::uint8_t* at =
        message.data.data() + (i / message.width) * message.row_step + (i % message.width) * message.point_step;
    for (int k = 0; k < 3; ++k)
      if (fields[k]->datatype == sensor_msgs::PointField::FLOAT32)
      {
        float value;
        std::memcpy(&value, at + fields[k]->offset, sizeof value);
        out(k, i) = value;
      }
      else
        std::memcpy(&out(k, i), at + fields[k]->offset, sizeof(double));
  }
  return "";
}

geometry_msgs::Vector3 toVector3(const Eigen::Vector3d& v)
{
  geometry_msgs::Vector3 out;
  out.x = v.x();
  out.y = v.y();
  out.z = v.z();
  return out;
}

geometry_msgs::Quaternion toQuaternion(const Eigen::Quaterniond& q)
{
  geometry_msgs::Quaternion out;
  out.x = q.x();
  out.y = q.y();
  out.z = q.z();
  out.w = q.w();
  return out;
}

geometry_msgs::Pose toMessage(const Pose& X)
{
  geometry_msgs::Pose out;
  out.position = toPoint(X.position);
  out.orientation = toQuaternion(X.orientation);
  return out;
}

geometry_msgs::Wrench toMessage(const Wrench& wrench)
{
  geometry_msgs::Wrench out;
  out.force = toVector3(wrench.force);
  out.torque = toVector3(wrench.torque);
  return out;
}

geometry_msgs::Twist toMessage(const Twist& twist)
{
  geometry_msgs::Twist out;
  out.linear = toVector3(twist.linear);
  out.angular = toVector3(twist.angular);
  return out;
}

std_msgs::Header makeHeader(const ros::Time& stamp, const std::string& frame_id)
{
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame_id;
  return header;
}

geometry_msgs::TransformStamped toTransform(const std_msgs::Header& header, const std::string& child, const Pose& X)
{
  geometry_msgs::TransformStamped out;
  out.header = header;
  out.child_frame_id = child;
  out.transform.translation = toVector3(X.position);
  out.transform.rotation = toQuaternion(X.orientation);
  return out;
}

Eigen::Vector3d fromMessage(const geometry_msgs::Point& p) { return {p.x, p.y, p.z}; }
Eigen::Vector3d fromMessage(const geometry_msgs::Vector3& v) { return {v.x, v.y, v.z}; }
Eigen::Quaterniond fromMessage(const geometry_msgs::Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

Pose recordedPose(const geometry_msgs::Pose& message)
{
  return {fromMessage(message.position), fromMessage(message.orientation)};
}

namespace {

PoseFault checked(const Eigen::Vector3d& p, const geometry_msgs::Quaternion& q, Pose& X)
{
  const Eigen::Vector4d c(q.x, q.y, q.z, q.w);
  if (!p.allFinite() || !c.allFinite())
    return PoseFault::not_finite;
  if (std::abs(c.norm() - 1.0) > 0.01)
    return PoseFault::bad_quaternion;
  X.position = p;
  X.orientation = fromMessage(q).normalized();
  return PoseFault::none;
}

}   // namespace

PoseFault fromMessage(const geometry_msgs::Pose& message, Pose& X)
{
  return checked(fromMessage(message.position), message.orientation, X);
}

PoseFault fromMessage(const geometry_msgs::Transform& message, Pose& X)
{
  return checked(fromMessage(message.translation), message.rotation, X);
}

bool isFinite(const geometry_msgs::Twist& twist)
{
  return fromMessage(twist.linear).allFinite() && fromMessage(twist.angular).allFinite();
}

void toMessage(const RodModel& model, const RodState& state, slender_sim::RodState& out)
{
  const int nodes = model.nodes(), edges = model.edges();
  out.name = model.name;
  out.closed = model.closed;
  out.nodes.resize(nodes);
  out.velocities.resize(nodes);
  out.twists.resize(nodes);
  for (int i = 0; i < nodes; ++i)
  {
    out.nodes[i] = toPoint(state.x.col(i));
    out.velocities[i] = toVector3(state.v.col(i));
    out.twists[i] = state.twistAt(i);
  }
  out.frames.resize(edges);
  forEachFrame(model, state, [&](int j, const Eigen::Matrix3d& axes) {
    out.frames[j] = toQuaternion(Eigen::Quaterniond(axes).normalized());
  });
  out.radii.assign(model.radius_a.data(), model.radius_a.data() + model.radius_a.size());
  if (model.radius_b == model.radius_a)
    out.radii_b.clear();
  else
    out.radii_b.assign(model.radius_b.data(), model.radius_b.data() + model.radius_b.size());
  out.constraint_errors.clear();
  out.guide_nodes.clear();
  out.guide_forces.clear();
}

void toTracking(const RodConfig& rod, const GuideState& guide, const RodState& state, slender_sim::RodState& out)
{
  const WeakConstraints& constraints = *rod.tracking->sets.front().constraints;
  const Eigen::Matrix3Xd targets = constraints.averages(guide.points);
  for (int i = 0; i < constraints.count(); ++i)
  {
    out.constraint_errors.push_back(constraints.distance(i, targets, state.x));
    out.guide_forces.push_back(toVector3(guide.forces.col(i)));
  }
  for (Eigen::Index k = 0; k < guide.points.cols(); ++k)
    out.guide_nodes.push_back(toPoint(guide.points.col(k)));
}

void toMessage(const ThreadState& state, slender_sim::ThreadState& out)
{
  const std::size_t nodes = state.x.size(), edges = state.volume.size();
  out.thread_id = state.thread_id;
  // the oldest node is not always the first by number: edges are divided; the one at the nozzle is there from the start
  out.first_id = *std::min_element(state.id.begin(), state.id.end() - 1);
  out.ids = state.id;
  out.twists = state.twist;
  out.deposited.assign(state.deposited.begin(), state.deposited.end());
  out.nodes.resize(nodes);
  out.velocities.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i)
  {
    out.nodes[i] = toPoint(state.x[i]);
    out.velocities[i] = toVector3(state.v[i]);
  }
  out.frames.resize(edges);
  out.radii.resize(edges);
  for (std::size_t j = 0; j < edges; ++j)
  {
    out.frames[j] = toQuaternion(edgeFrame(state, static_cast<int>(j)));
    out.radii[j] = state.radius(static_cast<int>(j));
  }
  out.fed_volume = state.fed_volume;
  out.dropped_volume = state.dropped_volume + state.left_volume;
}

void append(const std::string& name, const ClothState& state, slender_sim::ClothState& out)
{
  out.names.push_back(name);
  out.offsets.push_back(static_cast<std::uint32_t>(out.vertices.size()));
  for (Eigen::Index i = 0; i < state.x.cols(); ++i)
  {
    out.vertices.push_back(toPoint(state.x.col(i)));
    out.velocities.push_back(toVector3(state.v.col(i)));
  }
}

void appendTracking(double error, const Eigen::Matrix3Xd& guide, const Eigen::Matrix3Xd& forces,
                    slender_sim::ClothState& out)
{
  out.constraint_errors.push_back(error);
  out.guide_offsets.push_back(static_cast<std::uint32_t>(out.guide_vertices.size()));
  out.function_offsets.push_back(static_cast<std::uint32_t>(out.guide_forces.size()));
  for (Eigen::Index i = 0; i < guide.cols(); ++i)
    out.guide_vertices.push_back(toPoint(guide.col(i)));
  for (Eigen::Index i = 0; i < forces.cols(); ++i)
    out.guide_forces.push_back(toVector3(forces.col(i)));
}

void append(const ClothModel& model, slender_sim::MeshStamped& out)
{
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  out.names.push_back(model.name);
  out.vertex_offsets.push_back(first);
  out.triangle_offsets.push_back(static_cast<std::uint32_t>(out.triangles.size() / 3));
  for (Eigen::Index i = 0; i < model.rest.vertices.cols(); ++i)
    out.vertices.push_back(toPoint(model.rest.vertices.col(i)));
  for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
    for (int corner = 0; corner < 3; ++corner)
      out.triangles.push_back(first + static_cast<std::uint32_t>(model.rest.triangles(corner, f)));
}

void toPoints(const slender_sim::ClothState& state, sensor_msgs::PointCloud2& out)
{
  sensor_msgs::PointCloud2Modifier modifier(out);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(state.vertices.size());
  out.is_dense = true;
  sensor_msgs::PointCloud2Iterator<float> to(out, "x");
  for (const geometry_msgs::Point& p : state.vertices)
  {
    to[0] = static_cast<float>(p.x);
    to[1] = static_cast<float>(p.y);
    to[2] = static_cast<float>(p.z);
    ++to;
  }
}

}   // namespace slender
