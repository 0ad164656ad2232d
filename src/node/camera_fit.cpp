#include "slender_sim/node/camera_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <yaml-cpp/yaml.h>

#include "slender_sim/node/converters.h"

namespace slender {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;
using Points = std::vector<Eigen::Vector3d>;

constexpr double kFieldOfView = M_PI / 4;   // [rad] vertical angle of rviz's camera
constexpr double kFilled = 0.45;            // part of the picture that the points fill
constexpr double kSurroundings = 3.0;       // solids larger than this multiple of the objects are not shown whole
constexpr double kSmallest = 1e-3;          // [m] smallest size of a useful picture

bool startsWith(const std::string& text, const std::string& start) { return text.compare(0, start.size(), start) == 0; }

bool isSurroundings(const Marker& marker) { return marker.ns == "obstacles" || marker.ns == "floors"; }

bool isShape(const Marker& marker)
{
  return marker.action == Marker::ADD && marker.type != Marker::TEXT_VIEW_FACING && marker.type != Marker::ARROW &&
         !startsWith(marker.ns, "frames/");
}

/// Appends the points of a marker, or the corners of its box if it has no points.
void append(const Marker& marker, Points& points)
{
  const Eigen::Quaterniond turn = fromMessage(marker.pose.orientation);
  const bool turned = turn.norm() > 0.5;
  const Eigen::Vector3d place = fromMessage(marker.pose.position), scale = fromMessage(marker.scale);
  const auto add = [&](const Eigen::Vector3d& p) {
    points.push_back(place + (turned ? Eigen::Vector3d(turn.normalized() * p) : p));
  };
  if (marker.type == Marker::TRIANGLE_LIST || marker.type == Marker::LINE_LIST || marker.type == Marker::LINE_STRIP ||
      marker.type == Marker::POINTS || marker.type == Marker::SPHERE_LIST || marker.type == Marker::CUBE_LIST)
  {
    for (const geometry_msgs::Point& p : marker.points)
      add(marker.type == Marker::TRIANGLE_LIST ? Eigen::Vector3d(fromMessage(p).cwiseProduct(scale)) : fromMessage(p));
    return;
  }
  for (int corner = 0; corner < 8; ++corner)
    add(0.5 * scale.cwiseProduct(Eigen::Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
}

Eigen::AlignedBox3d boxOf(const Points& points)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points)
    box.extend(p);
  return box;
}

/// Returns one point of each occupied cell of a grid over the bounding box of the points.
Points thinnedOut(const Points& points)
{
  constexpr int kCells = 256;   // per side of the box
  const Eigen::AlignedBox3d box = boxOf(points);
  const Eigen::Vector3d scale = (kCells - 1) * box.sizes().cwiseMax(kSmallest).cwiseInverse();
  std::vector<bool> taken(kCells * kCells * kCells);
  Points thin;
  for (const Eigen::Vector3d& p : points)
  {
    const Eigen::Vector3i cell = (p - box.min()).cwiseProduct(scale).cast<int>();
    const auto index = static_cast<std::size_t>((cell.x() * kCells + cell.y()) * kCells + cell.z());
    if (!taken[index])
      thin.push_back(p);
    taken[index] = true;
  }
  return thin;
}

/// Returns the points that lie farthest out in evenly spread directions. These points bound every picture.
Points outermost(const Points& points)
{
  constexpr int kDirections = 400;
  if (points.size() <= kDirections)
    return points;
  const Points thin = thinnedOut(points);
  Points hull;
  for (int k = 0; k < kDirections; ++k)   // directions on a spiral from pole to pole, evenly dense
  {
    const double z = 1.0 - (2.0 * k + 1.0) / kDirections, r = std::sqrt(1.0 - z * z), angle = 2.39996323 * k;
    const Eigen::Vector3d direction(r * std::cos(angle), r * std::sin(angle), z);
    hull.push_back(*std::max_element(
        thin.begin(), thin.end(), [&](const auto& a, const auto& b) { return direction.dot(a) < direction.dot(b); }));
  }
  return hull;
}

/// Finds the view in one direction, at a given distance, that has the points in the middle of the picture.
class ViewFit
{
public:
  struct Result
  {
    Eigen::Vector3d focal_point;
    double filled = 0.0;   ///< filled part of the picture's width or height, whichever is larger
  };

  ViewFit(const OrbitView& view, double aspect)
    : towards_eye_(std::cos(view.yaw) * std::cos(view.pitch), std::sin(view.yaw) * std::cos(view.pitch),
                   std::sin(view.pitch)),
      right_(-std::sin(view.yaw), std::cos(view.yaw), 0.0),
      up_(towards_eye_.cross(right_)),
      tangent_y_(std::tan(0.5 * kFieldOfView)),
      tangent_x_(aspect * tangent_y_)
  {
  }

  Result at(const Points& points, double distance) const
  {
    Result result{boxOf(points).center(), 0.0};
    for (int round = 0; round < 12; ++round)   // each round, perspective moves the middle a little
    {
      Eigen::AlignedBox2d picture;   // in units of half its width and half its height
      for (const Eigen::Vector3d& p : points)
      {
        const Eigen::Vector3d r = p - result.focal_point;
        const double depth = std::max(distance - towards_eye_.dot(r), 1e-3 * distance);
        picture.extend(Eigen::Vector2d(right_.dot(r) / (depth * tangent_x_), up_.dot(r) / (depth * tangent_y_)));
      }
      const Eigen::Vector2d middle = picture.center();
      result.filled = 0.5 * picture.sizes().maxCoeff();
      result.focal_point += 0.7 * distance * (middle.x() * tangent_x_ * right_ + middle.y() * tangent_y_ * up_);
    }
    return result;
  }

private:
  Eigen::Vector3d towards_eye_, right_, up_;
  double tangent_y_, tangent_x_;
};

double numberOf(const YAML::Node& node, double otherwise) { return node ? node.as<double>(otherwise) : otherwise; }

}   // namespace

Points pointsToShow(const MarkerArray& markers)
{
  Points points;
  for (const Marker& marker : markers.markers)
    if (isShape(marker) && !isSurroundings(marker))
      append(marker, points);
  const Eigen::AlignedBox3d objects = boxOf(points);
  for (const Marker& marker : markers.markers)
  {
    if (!isShape(marker) || !isSurroundings(marker))
      continue;
    Points solid;
    append(marker, solid);
    const Eigen::AlignedBox3d box = boxOf(solid);
    if (objects.isEmpty() || box.diagonal().norm() <= kSurroundings * objects.diagonal().norm())
    {
      points.insert(points.end(), solid.begin(), solid.end());
      continue;
    }
    // A wide floor counts only below the objects, where a thread comes down.
    const Eigen::Vector3d below(objects.center().x(), objects.center().y(), box.max().z());
    const double height = objects.max().z() - below.z();
    if (marker.ns == "floors" && height > 0)
      for (const double side : {-0.25, 0.25})
      {
        points.push_back(below + Eigen::Vector3d(side * height, 0, 0));
        points.push_back(below + Eigen::Vector3d(0, side * height, 0));
      }
  }
  return points;
}

OrbitView fittedView(const Points& points, const OrbitView& view, double aspect)
{
  if (points.empty())
    return view;
  const Points hull = outermost(points);
  const double radius = std::max(kSmallest, 0.5 * boxOf(hull).diagonal().norm());
  // All points are well in front of the camera. The filled part of the picture decreases with the distance.
  double low = 1.5 * radius, high = 100.0 * radius;
  const ViewFit fit(view, aspect);
  for (int round = 0; round < 50; ++round)
  {
    const double middle = std::sqrt(low * high);
    (fit.at(hull, middle).filled > kFilled ? low : high) = middle;
  }
  OrbitView fitted = view;
  fitted.distance = high;
  fitted.focal_point = fit.at(hull, high).focal_point;
  return fitted;
}

std::optional<std::string> fittedConfig(const std::string& config, const Points& points)
{
  try
  {
    YAML::Node root = YAML::Load(config);
    YAML::Node current = root["Visualization Manager"]["Views"]["Current"];
    if (!current || current["Class"].as<std::string>("") != "rviz/Orbit")
      return std::nullopt;
    const YAML::Node window = root["Window Geometry"];
    constexpr double kBars = 80.0;   // pixels of the menu and tool bars
    const double width = numberOf(window["Width"], 1280), height = numberOf(window["Height"], 800) - kBars;
    OrbitView view;
    view.yaw = numberOf(current["Yaw"], 0.785398);
    view.pitch = numberOf(current["Pitch"], 0.785398);
    view.distance = numberOf(current["Distance"], 10);
    view = fittedView(points, view, width / std::max(height, 1.0));
    current["Distance"] = view.distance;
    YAML::Node focal = current["Focal Point"];
    focal["X"] = view.focal_point.x();
    focal["Y"] = view.focal_point.y();
    focal["Z"] = view.focal_point.z();
    current["Near Clip Distance"] = std::min(numberOf(current["Near Clip Distance"], 0.01), 0.02 * view.distance);
    YAML::Emitter out;
    out << root;
    return std::string(out.c_str()) + "\n";
  }
  catch (const YAML::Exception&)
  {
    return std::nullopt;
  }
}

std::vector<std::string> markerTopics(const std::string& config)
{
  std::vector<std::string> topics;
  try
  {
    for (const YAML::Node& display : YAML::Load(config)["Visualization Manager"]["Displays"])
      if (display["Class"].as<std::string>("") == "rviz/MarkerArray" && display["Marker Topic"])
        topics.push_back(display["Marker Topic"].as<std::string>());
  }
  catch (const YAML::Exception&)
  {
    topics.clear();
  }
  return topics;
}

}   // namespace slender
