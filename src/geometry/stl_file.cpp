#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "slender_sim/geometry/mesh_file.h"

namespace slender {

namespace {

constexpr std::size_t kStlHeader = 84;     // [bytes]: text, and the number of triangles
constexpr std::size_t kStlTriangle = 50;   // [bytes]: normal, three corners, attribute

/// An STL file lists the corners of each triangle. Corners with the same coordinates become one vertex, and triangles
/// with two equal corners are left out.
class StlMesh
{
public:
  void addCorner(const Eigen::Vector3d& corner)
  {
    const auto [known, is_new] =
        numbers_.emplace(std::array<double, 3>{corner.x(), corner.y(), corner.z()}, static_cast<int>(vertices_.size()));
    if (is_new)
      vertices_.push_back(corner);
    triangle_[corners_++] = known->second;
    if (corners_ < 3)
      return;
    corners_ = 0;
    if (triangle_[0] != triangle_[1] && triangle_[1] != triangle_[2] && triangle_[2] != triangle_[0])
      triangles_.push_back(triangle_);
  }

  bool hasPartOfTriangle() const { return corners_ != 0; }

  TriangleMesh mesh(const std::string& path) const
  {
    if (triangles_.empty())
      throw std::runtime_error(path + ": has no triangles");
    return triangleMesh(vertices_, triangles_);
  }

private:
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::map<std::array<double, 3>, int> numbers_;
  Eigen::Vector3i triangle_ = Eigen::Vector3i::Zero();
  int corners_ = 0;
};

TriangleMesh readBinaryStl(const std::string& path, const std::string& bytes, std::uint32_t count)
{
  StlMesh mesh;
  for (std::uint32_t t = 0; t < count; ++t)
    for (int corner = 0; corner < 3; ++corner)
    {
      float values[3];
      std::memcpy(values, bytes.data() + kStlHeader + kStlTriangle * t + 12 * (corner + 1), sizeof values);
      const Eigen::Vector3d point(values[0], values[1], values[2]);
      if (!point.allFinite())
        throw std::runtime_error(path + ": triangle " + std::to_string(t + 1) + " has a corner that is not finite");
      mesh.addCorner(point);
    }
  return mesh.mesh(path);
}

double stlNumber(const std::string& path, const std::string& word)
{
  double value = 0.0;
  const char *begin = word.data() + (!word.empty() && word[0] == '+' ? 1 : 0), *end = word.data() + word.size();
  const auto result = std::from_chars(begin, end, value);
  if (word.empty() || result.ec != std::errc() || result.ptr != end || !std::isfinite(value))
    throw std::runtime_error(path + ": '" + word + "' is not a finite number; must be vertex X Y Z");
  return value;
}

TriangleMesh readAsciiStl(const std::string& path, const std::string& text)
{
  StlMesh mesh;
  std::istringstream words(text);
  for (std::string word; words >> word;)
  {
    if (word != "vertex")
      continue;
    Eigen::Vector3d point;
    for (int k = 0; k < 3; ++k)
    {
      word.clear();
      words >> word;
      point[k] = stlNumber(path, word);
    }
    mesh.addCorner(point);
  }
  if (mesh.hasPartOfTriangle())
    throw std::runtime_error(path + ": ends within a triangle");
  return mesh.mesh(path);
}

}   // namespace

TriangleMesh readStl(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(path + ": cannot be opened");
  std::ostringstream content;
  content << file.rdbuf();
  const std::string bytes = content.str();
  // A binary file may begin with the word solid, too. The length of the file shows whether it is binary.
  if (bytes.size() >= kStlHeader)
  {
    const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])); };
    const std::uint32_t count = byte(80) | byte(81) << 8 | byte(82) << 16 | byte(83) << 24;
    if (bytes.size() == kStlHeader + kStlTriangle * static_cast<std::size_t>(count))
      return readBinaryStl(path, bytes, count);
  }
  if (bytes.compare(0, 5, "solid") != 0)
    throw std::runtime_error(path +
                             ": is no STL file: it does not begin with the word solid, and its length is not that of "
                             "a binary file with its number of triangles");
  return readAsciiStl(path, bytes);
}

}   // namespace slender
