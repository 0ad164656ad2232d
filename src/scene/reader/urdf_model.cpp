#include "urdf_model.h"

#include <algorithm>
#include <cctype>
#include <memory>
#include <stdexcept>

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/file_paths.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

/// Collects the error messages of urdfdom as long as this object exists. Otherwise urdfdom prints them.
class UrdfComplaints : public console_bridge::OutputHandler
{
public:
  UrdfComplaints() { console_bridge::useOutputHandler(this); }
  ~UrdfComplaints() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override
  {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR)
      text_ += (text_.empty() ? "" : "; ") + text;
  }
  const std::string& text() const { return text_; }

private:
  std::string text_;
};

std::shared_ptr<urdf::ModelInterface> parse(const std::string& text)
{
  if (text.find("<xacro:") != std::string::npos)
    throw std::runtime_error("is a xacro file; expand it first: xacro FILE.xacro > FILE.urdf");
  std::shared_ptr<urdf::ModelInterface> model;
  std::string complaints;
  {
    UrdfComplaints listener;
    model = urdf::parseURDF(text);
    complaints = listener.text();
  }
  if (!model)
    throw std::runtime_error("is no valid URDF: " + (complaints.empty() ? "no robot found" : complaints));
  return model;
}

Pose poseOf(const urdf::Pose& pose)
{
  Pose result;
  result.position = {pose.position.x, pose.position.y, pose.position.z};
  result.orientation =
      Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z).normalized();
  return result;
}

/// Throws std::runtime_error if the joints do not form a tree. urdfdom silently drops joints of such a description.
void checkTree(const urdf::ModelInterface& model)
{
  std::map<std::string, std::string> parents;   // child link to its joint
  for (const auto& [name, joint] : model.joints_)
  {
    const auto [other, is_new] = parents.emplace(joint->child_link_name, name);
    if (!is_new)
      throw std::runtime_error("link " + joint->child_link_name + " has two parent joints, " + other->second + " and " +
                               name + ": a URDF is a tree; leave one of them out");
  }
  for (const auto& [name, link] : model.links_)
  {
    std::string at = name;
    std::size_t steps = 0;
    for (auto up = parents.find(at); up != parents.end(); up = parents.find(at))
    {
      at = model.joints_.at(up->second)->parent_link_name;
      if (++steps > model.links_.size())
        throw std::runtime_error("link " + name + " is in a loop of joints: a URDF is a tree; leave one joint out");
    }
  }
}

/// Returns the motion of a joint relative to its origin at a position [rad] or [m].
Pose jointMotion(const urdf::Joint& joint, double position)
{
  Pose motion;
  const Eigen::Vector3d axis(joint.axis.x, joint.axis.y, joint.axis.z);
  if (!(axis.norm() > 0))
    return motion;
  if (joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS)
    motion.orientation = Eigen::AngleAxisd(position, axis.normalized());
  else if (joint.type == urdf::Joint::PRISMATIC)
    motion.position = position * axis.normalized();
  return motion;
}

/// Returns the position of a joint. A joint with `mimic` follows its leader; joints that mimic each other stay at 0.
double positionOf(const urdf::ModelInterface& model, const urdf::Joint& joint, const UrdfOptions& options,
                  int depth = 0)
{
  const auto given = options.joints.find(joint.name);
  if (given != options.joints.end())
    return given->second;
  if (!joint.mimic || depth > 20)
    return 0.0;
  const auto leader = model.joints_.find(joint.mimic->joint_name);
  if (leader == model.joints_.end())
    throw std::runtime_error("joint " + joint.name + " mimics joint " + joint.mimic->joint_name +
                             ", which the robot does not have");
  return joint.mimic->multiplier * positionOf(model, *leader->second, options, depth + 1) + joint.mimic->offset;
}

std::string lowerEnding(const std::string& path)
{
  const auto dot = path.rfind('.');
  std::string ending = dot == std::string::npos ? "" : path.substr(dot + 1);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

Shape meshShape(const urdf::Mesh& geometry, const UrdfOptions& options)
{
  const std::string path = options.resolve(geometry.filename), ending = lowerEnding(path);
  requireRegularFile(path);
  auto mesh = std::make_shared<TriangleMesh>();
  if (ending == "stl")
    *mesh = readStl(path);
  else if (ending == "dae")
    *mesh = readCollada(path);
  else if (ending == "obj")
    *mesh = readObj(path);
  else if (ending == "ply")
    *mesh = readPly(path);
  else
    throw std::runtime_error(path + ": must be a mesh file that ends in .stl, .dae, .obj or .ply");
  const Eigen::Vector3d scale(geometry.scale.x, geometry.scale.y, geometry.scale.z);
  if (!(scale.cwiseAbs().minCoeff() > 0) || !scale.allFinite())
    throw std::runtime_error(geometry.filename + ": its scale must not be 0");
  mesh->vertices = scale.asDiagonal() * mesh->vertices;
  if (scale.prod() < 0)   // a mirrored mesh has its outer sides inside, so turn the triangles over
    mesh->triangles.row(1).swap(mesh->triangles.row(2));
  return std::shared_ptr<const TriangleMesh>(std::move(mesh));
}

Shape shapeOf(const urdf::Geometry& geometry, const UrdfOptions& options)
{
  switch (geometry.type)
  {
    case urdf::Geometry::SPHERE: return Sphere{static_cast<const urdf::Sphere&>(geometry).radius};
    case urdf::Geometry::BOX:
    {
      const urdf::Vector3& size = static_cast<const urdf::Box&>(geometry).dim;
      return Box{{size.x, size.y, size.z}};
    }
    case urdf::Geometry::CYLINDER:
    {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      return Cylinder{cylinder.radius, cylinder.length};
    }
    case urdf::Geometry::MESH: break;
  }
  return meshShape(static_cast<const urdf::Mesh&>(geometry), options);
}

UrdfLink readLink(const urdf::Link& link, const Pose& X_RL, const UrdfOptions& options)
{
  UrdfLink result{link.name, X_RL, {}};
  if (options.ignored.count(link.name))
    return result;
  auto collisions = link.collision_array;
  if (collisions.empty() && link.collision)
    collisions.push_back(link.collision);
  for (const auto& collision : collisions)
  {
    try
    {
      result.elements.push_back({shapeOf(*collision->geometry, options), poseOf(collision->origin)});
      checkShape(result.elements.back().shape);
    }
    catch (const std::exception& error)
    {
      throw std::runtime_error("link " + link.name + ": " + error.what());
    }
  }
  return result;
}

void addLinks(const urdf::ModelInterface& model, const urdf::Link& link, const Pose& X_RL, const UrdfOptions& options,
              std::vector<UrdfLink>& links)
{
  links.push_back(readLink(link, X_RL, options));
  for (const auto& joint : link.child_joints)
  {
    const Pose X_RC = X_RL * poseOf(joint->parent_to_joint_origin_transform) *
                      jointMotion(*joint, positionOf(model, *joint, options));
    addLinks(model, *model.links_.at(joint->child_link_name), X_RC, options, links);
  }
}

/// Throws std::runtime_error if the robot has no part with this name.
template <class Known>
void requireKnown(const std::string& kind, const std::string& name, const Known& known)
{
  if (known.count(name))
    return;
  std::vector<std::string> names;
  for (const auto& entry : known)
    names.push_back(entry.first);
  const std::string hint = didYouMean(name, names);
  throw std::runtime_error("the robot has no " + kind + " " + name +
                           (hint.empty() ? "; it has: " + joinWords(names) : hint));
}

}   // namespace

std::vector<UrdfLink> readUrdf(const std::string& text, const UrdfOptions& options)
{
  const std::shared_ptr<urdf::ModelInterface> model = parse(text);
  checkTree(*model);
  for (const std::string& link : options.ignored)
    requireKnown("link", link, model->links_);
  for (const auto& [joint, position] : options.joints)
    requireKnown("joint", joint, model->joints_);
  std::vector<UrdfLink> links;
  addLinks(*model, *model->getRoot(), Pose(), options, links);
  return links;
}

}   // namespace slender
