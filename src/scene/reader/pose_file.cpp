#include "slender_sim/scene/pose_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <unordered_map>

#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/reader.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

constexpr double quaternion_slack = 0.01;
constexpr double largest_turn = 0.99 * M_PI;   // [rad] between two samples

double number(const std::string& cell, const char* column)
{
  const auto value = parseNumber(cell);
  if (!value)
    throw std::invalid_argument(std::string(column) + " = '" + cell + "' is not a number");
  if (!std::isfinite(*value))
    throw std::invalid_argument(std::string(column) + " = '" + cell + "' is not finite");
  return *value;
}

/// Calls row(cells) for every data line with cells as many as columns; turns its std::invalid_argument into a
/// SceneError.
template <class Row>
void readTable(const std::string& path, const std::vector<std::string>& columns, Row row)
{
  try
  {
    requireRegularFile(path);
  }
  catch (const std::runtime_error& error)
  {
    throw SceneError(error.what());
  }
  std::ifstream file(path);
  if (!file)
    throw SceneError(path + ": cannot be opened for reading");
  std::string line;
  bool first = true;
  for (int count = 1; std::getline(file, line); ++count)
  {
    line = trimmed(line);
    if (line.empty() || line[0] == '#')
      continue;
    std::vector<std::string> cells = split(line, ',');
    std::transform(cells.begin(), cells.end(), cells.begin(), trimmed);
    const bool header = first && cells == columns;
    first = false;
    if (header)
      continue;
    const std::string where = path + ":" + std::to_string(count) + ": ";
    if (cells.size() != columns.size())
    {
      throw SceneError(where + "has " + std::to_string(cells.size()) + " columns; must have " +
                       std::to_string(columns.size()) + ": " + joinWords(columns));
    }
    try
    {
      row(cells);
    }
    catch (const std::invalid_argument& error)
    {
      throw SceneError(where + error.what());
    }
  }
  if (file.bad())
    throw SceneError(path + ": reading failed");
}

}   // namespace

Pose checkedPose(const double* numbers)
{
  Pose pose;
  pose.position = {numbers[0], numbers[1], numbers[2]};
  pose.orientation = Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]);
  const double length = pose.orientation.norm();
  if (!(std::abs(length - 1) <= quaternion_slack))
    throw std::invalid_argument("the quaternion's length is " + shortNumber(length) + "; must be in [0.99, 1.01]");
  pose.orientation.normalize();
  return pose;
}

void appendRecorded(PoseTrajectory& poses, double time, const Pose& pose)
{
  if (!poses.empty() && time > poses.lastTime())
  {
    const double turn = poses.evaluate(poses.lastTime()).orientation.angularDistance(pose.orientation);
    if (turn > largest_turn)
    {
      throw std::invalid_argument(
          "turns by " + shortNumber(turn * 180 / M_PI) + " degrees since the sample before; must be under " +
          shortNumber(largest_turn * 180 / M_PI) + " (add samples between, so that the way is clear)");
    }
  }
  poses.append(time, pose);
}

std::vector<BodyTrajectory> readPoseFile(const std::string& path)
{
  static const std::vector<std::string> columns{"t", "body", "x", "y", "z", "qx", "qy", "qz", "qw"};
  std::vector<BodyTrajectory> bodies;
  std::unordered_map<std::string, std::size_t> index;
  readTable(path, columns, [&](const std::vector<std::string>& cells) {
    std::array<double, 7> numbers;
    const double time = number(cells[0], "t");
    for (std::size_t k = 0; k < numbers.size(); ++k)
      numbers[k] = number(cells[k + 2], columns[k + 2].c_str());
    if (cells[1].empty())
      throw std::invalid_argument("body is empty; must be a name");
    const auto [entry, is_new] = index.emplace(cells[1], bodies.size());
    if (is_new)
      bodies.push_back({cells[1], {}});
    appendRecorded(bodies[entry->second].poses, time, checkedPose(numbers.data()));
  });
  if (bodies.empty())
    throw SceneError(path + ": has no poses; must have at least one line " + joinWords(columns));
  return bodies;
}

std::vector<Eigen::Vector3d> readPointFile(const std::string& path)
{
  static const std::vector<std::string> columns{"x", "y", "z"};
  std::vector<Eigen::Vector3d> points;
  readTable(path, columns, [&](const std::vector<std::string>& cells) {
    points.emplace_back(number(cells[0], "x"), number(cells[1], "y"), number(cells[2], "z"));
  });
  return points;
}

void appendPoints(PointTrajectory& points, const std::vector<double>& row)
{
  points.append(row[0],
                Eigen::Map<const Eigen::Matrix3Xd>(row.data() + 1, 3, static_cast<Eigen::Index>(row.size() / 3)));
}

PointTrajectory readPointMotion(const std::string& path, int count)
{
  std::vector<std::string> columns{"t"};
  for (int i = 0; i < count; ++i)
    for (const char* axis : {"x", "y", "z"})
      columns.push_back(axis + std::to_string(i));
  PointTrajectory points;
  std::vector<double> row(columns.size());
  readTable(path, columns, [&](const std::vector<std::string>& cells) {
    for (std::size_t k = 0; k < row.size(); ++k)
      row[k] = number(cells[k], columns[k].c_str());
    appendPoints(points, row);
  });
  if (points.empty())
    throw SceneError(path + ": has no points; must have at least one line " + joinWords(columns));
  return points;
}

}   // namespace slender
