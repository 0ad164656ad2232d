// Reads the key `robot`. The collision shapes of the links become obstacles of the scene.
#include "slender_sim/scene/robot.h"

#include <filesystem>
#include <stdexcept>

#include "read_parts.h"
#include "scene_text.h"
#include "urdf_model.h"

namespace slender {

namespace {

RobotSources& robotSources()
{
  static RobotSources sources;
  return sources;
}

bool startsWith(const std::string& text, const std::string& beginning)
{
  return text.compare(0, beginning.size(), beginning) == 0;
}

bool isUrdfText(const std::string& description)
{
  const auto first = description.find_first_not_of(" \t\r\n");
  return first != std::string::npos && description[first] == '<';
}

/// Returns the path of a file. `name` is package://NAME/PATH, file://PATH, or a path relative to `directory`.
std::string filePath(const std::string& name, const std::string& directory)
{
  const std::string package = "package://", file = "file://";
  if (startsWith(name, package))
  {
    const auto slash = name.find('/', package.size());
    const std::string who = name.substr(package.size(), slash - package.size());
    if (!robotSources().package)
      throw std::runtime_error(name + ": this program knows no ROS packages; give a path, or build it with ROS");
    const std::string folder = robotSources().package(who);
    if (folder.empty())
      throw std::runtime_error(name + ": there is no ROS package " + who +
                               "; source its setup.bash, or put its folder into ROS_PACKAGE_PATH");
    return slash == std::string::npos ? folder : folder + name.substr(slash);
  }
  if (startsWith(name, file))
    return name.substr(file.size());
  if (name.find("://") != std::string::npos)
    throw std::runtime_error(name + ": must be a path, package://NAME/PATH or file://PATH");
  return name.empty() || name[0] == '/' ? name : directory + "/" + name;
}

/// A robot description, and the folder from which its relative paths start.
struct Description
{
  std::string text, directory;
};

Description describe(const std::string& description, const std::string& directory)
{
  if (isUrdfText(description))
    return {description, directory};
  const std::string path = filePath(description, directory);
  std::error_code error;
  if (!std::filesystem::exists(path, error))
  {
    if (robotSources().parameter && robotSources().parameter(description))
      throw std::runtime_error("the ROS parameter " + description + " is no URDF, which begins with <");
    throw std::runtime_error(
        "there is no file " + path +
        (robotSources().parameter
             ? " and no ROS parameter of this name: start what sets it first, for example <param name=\"" +
                   description + "\" textfile=...> in the launch file"
             : ", and ROS parameters are for nodes: rosparam get -p " + description + " > robot.urdf makes a file"));
  }
  return {fileText(path), std::filesystem::path(path).parent_path().string()};
}

std::set<std::string> readIgnoredLinks(const YamlCursor& at)
{
  std::set<std::string> links;
  for (const YamlCursor& item : at.items())
    if (const auto name = item.text())
      links.insert(*name);
  return links;
}

std::map<std::string, double> readJoints(const YamlCursor& at)
{
  std::map<std::string, double> joints;
  if (at.present())
    for (const auto& [name, position] : at.members("Position of the joint of this name [rad] or [m]."))
      if (const auto value = position.number(Range::closed(-1e3, 1e3)))
        joints[name] = *value;
  return joints;
}

/// Adds the obstacles of a link. An obstacle has the name of the link, with a number if there are several.
void addObstacles(const UrdfLink& link, const ObstacleConfig& common, const Pose& X_WR, const std::string& prefix,
                  const YamlCursor& at, std::vector<std::pair<ObstacleConfig, YamlCursor>>& obstacles)
{
  for (std::size_t k = 0; k < link.elements.size(); ++k)
  {
    ObstacleConfig obstacle = common;
    obstacle.link = (prefix.empty() ? "" : prefix + "/") + link.name;
    obstacle.name = obstacle.link + (link.elements.size() == 1 ? "" : "_" + std::to_string(k));
    obstacle.shape = link.elements[k].shape;
    obstacle.pose = X_WR * link.X_RL * link.elements[k].X_LC;
    if (!(obstacle.pose.position.cwiseAbs().maxCoeff() <= kMaxCoordinate) ||
        !obstacle.pose.orientation.coeffs().allFinite())
      throw std::runtime_error("link " + link.name + " is not at a finite place within " + shortNumber(kMaxCoordinate) +
                               " m");
    obstacle.motion = TfMotion{obstacle.link, link.elements[k].X_LC};
    obstacles.emplace_back(std::move(obstacle), at);
  }
}

void readRobot(const YamlCursor& at, const ReadContext& context,
               std::vector<std::pair<ObstacleConfig, YamlCursor>>& obstacles)
{
  UrdfOptions options;
  std::string prefix;
  ObstacleConfig common;
  YamlMap map(at.sharesKeysOf("robot"));
  const YamlCursor at_description =
      map.require("description",
                  "Robot description (URDF): a file, relative to the scene's or package://NAME/PATH; in a node also "
                  "the name of a ROS parameter, such as robot_description; or the text itself.");
  const auto description = at_description.text();
  map.get("prefix", prefix,
          "Prefix of the links' names in tf: the frame of a link is PREFIX/LINK. Without the key the frame is LINK.");
  options.ignored = readIgnoredLinks(map.get("ignore", "Names of links that nothing touches. Without the key: none."));
  options.joints = readJoints(map.get(
      "joints",
      "Positions of joints at the start, until tf tells where the links are. Of joints that are not named: 0."));
  const YamlCursor pose = map.get(
      "pose", "Where the root link is at the start, until tf tells. Without the key: at the origin, not turned.");
  const Pose X_WR = readPose(pose).value_or(Pose());
  map.get("friction", common.friction, Range::closed(0, 100),
          "Coefficient of friction of all links, as of an obstacle. Without the key: that of the other object.");
  if (!description)
    return;
  const std::size_t before = obstacles.size();
  const bool good = at_description.attempt([&] {
    const Description robot = describe(*description, context.directory);
    options.resolve = [&](const std::string& name) { return filePath(name, robot.directory); };
    for (const UrdfLink& link : readUrdf(robot.text, options))
      addObstacles(link, common, X_WR, prefix, at, obstacles);
  });
  if (good && obstacles.size() == before)
    at.warning("no link of the robot has a collision shape, or all are ignored: nothing touches it.");
}

}   // namespace

void setRobotSources(RobotSources sources) { robotSources() = std::move(sources); }

std::vector<std::pair<ObstacleConfig, YamlCursor>> readRobots(const YamlCursor& at, const ReadContext& context)
{
  std::vector<std::pair<ObstacleConfig, YamlCursor>> obstacles;
  if (!at.present())
    return obstacles;
  for (const YamlCursor& robot : at.isList() ? at.items(1, 1000) : std::vector<YamlCursor>{at})
    readRobot(robot, context, obstacles);
  return obstacles;
}

bool takeRobotParameters(YamlTree& scene, const std::string& directory)
{
  YamlTree* robot = scene.kind == YamlTree::Kind::map ? scene.find("robot") : nullptr;
  if (!robot || !robotSources().parameter)
    return false;
  std::vector<YamlTree*> robots;
  if (robot->kind == YamlTree::Kind::map)
    robots.push_back(robot);
  for (YamlTree& item : robot->items)
    robots.push_back(&item);
  bool taken = false;
  for (YamlTree* one : robots)
  {
    YamlTree* description = one->kind == YamlTree::Kind::map ? one->find("description") : nullptr;
    std::error_code error;
    if (!description || description->kind != YamlTree::Kind::scalar || isUrdfText(description->scalar) ||
        description->scalar.find("://") != std::string::npos ||
        std::filesystem::exists(filePath(description->scalar, directory), error))
      continue;
    if (const auto text = robotSources().parameter(description->scalar); text && isUrdfText(*text))
    {
      description->scalar = *text;
      taken = true;
    }
  }
  return taken;
}

}   // namespace slender
