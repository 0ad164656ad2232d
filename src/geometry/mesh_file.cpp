#include "slender_sim/geometry/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace slender {

namespace {

/// Goes through the words of one line.
class Words
{
public:
  explicit Words(std::string line) : line_(std::move(line)) {}

  /// The next word; empty at the end of the line.
  std::string next()
  {
    const auto begin = line_.find_first_not_of(" \t\r", at_);
    const auto end = line_.find_first_of(" \t\r", begin);
    at_ = std::min(end, line_.size());
    return begin == std::string::npos ? "" : line_.substr(begin, at_ - begin);
  }

private:
  std::string line_;
  std::size_t at_ = 0;
};

class ObjReader
{
public:
  explicit ObjReader(const std::string& path) : path_(path) {}

  std::vector<VertexGroup> groups()
  {
    for (VertexGroup& g : groups_)
    {
      std::sort(g.vertices.begin(), g.vertices.end());
      g.vertices.erase(std::unique(g.vertices.begin(), g.vertices.end()), g.vertices.end());
    }
    return groups_;
  }

  TriangleMesh read()
  {
    std::ifstream file(path_);
    if (!file)
      throw std::runtime_error(path_ + ": cannot be opened");
    for (std::string text; std::getline(file, text);)
    {
      ++line_;
      while (!text.empty() && text.back() == '\\')   // continued on the next line
      {
        text.back() = ' ';
        std::string more;
        std::getline(file, more);
        ++line_;
        text += more;
      }
      readLine(text);
    }
    if (file.bad())
      throw std::runtime_error(path_ + ": cannot be read");
    return finish();
  }

private:
  [[noreturn]] void fail(int line, const std::string& reason) const
  {
    throw std::runtime_error(path_ + ":" + std::to_string(line) + ": " + reason);
  }

  void readLine(const std::string& text)
  {
    Words words(text.substr(0, text.find('#')));
    const std::string kind = words.next();
    if (kind == "v")
    {
      for (int k = 0; k < 3; ++k)
        coordinates_.push_back(coordinate(words.next()));
    }
    else if (kind == "f")
    {
      readFace(words);
    }
    else if (kind == "g")
    {
      current_.clear();
      for (std::string name = words.next(); !name.empty(); name = words.next())
        if (name != "default")
          current_.push_back(group(name));
    }
  }

  std::size_t group(const std::string& name)
  {
    const auto [known, is_new] = group_places_.emplace(name, groups_.size());
    if (is_new)
      groups_.push_back({name, {}});
    return known->second;
  }

  double coordinate(const std::string& word) const
  {
    double value = 0.0;
    const char* begin = word.data() + (word[0] == '+' ? 1 : 0);   // a string has a terminating zero
    const char* end = word.data() + word.size();
    const auto result = std::from_chars(begin, end, value);
    if (word.empty() || result.ec != std::errc() || result.ptr != end || !std::isfinite(value))
    {
      fail(line_, "vertex " + std::to_string(coordinates_.size() / 3 + 1) + ": '" + word +
                      "' is not a finite number; must be v X Y Z");
    }
    return value;
  }

  void readFace(Words& words)
  {
    std::vector<int> polygon;
    for (std::string word = words.next(); !word.empty(); word = words.next())
      polygon.push_back(index(word.substr(0, word.find('/')), word));
    sorted_ = polygon;
    std::sort(sorted_.begin(), sorted_.end());
    const auto twice = std::adjacent_find(sorted_.begin(), sorted_.end());
    if (twice != sorted_.end())
      fail(line_, "face with vertex " + std::to_string(*twice + 1) + " twice");
    if (polygon.size() < 3)
      fail(line_, "face with " + std::to_string(polygon.size()) + " vertices; must have at least 3");
    for (const std::size_t g : current_)
      groups_[g].vertices.insert(groups_[g].vertices.end(), polygon.begin(), polygon.end());
    for (std::size_t k = 2; k < polygon.size(); ++k)
      triangles_.push_back({{polygon[0], polygon[k - 1], polygon[k]}, line_});
  }

  /// From 0. Negative ones count from the last vertex so far.
  int index(const std::string& digits, const std::string& word) const
  {
    long value = 0;
    const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const long so_far = static_cast<long>(coordinates_.size() / 3);
    const bool good =
        result.ec == std::errc() && result.ptr == digits.data() + digits.size() && value != 0 && value >= -so_far;
    if (!good || value > 1'000'000'000)
    {
      fail(line_, "face vertex '" + word + "'; must be a whole number from 1, or negative and then at least " +
                      std::to_string(-so_far));
    }
    return static_cast<int>(value > 0 ? value - 1 : so_far + value);
  }

  TriangleMesh finish() const
  {
    if (triangles_.empty())
      throw std::runtime_error(path_ + ": has no faces (f A B C)");
    TriangleMesh mesh;
    const auto count = static_cast<Eigen::Index>(coordinates_.size() / 3);
    mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(coordinates_.data(), 3, count);
    mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (std::size_t i = 0; i < triangles_.size(); ++i)
    {
      for (int k = 0; k < 3; ++k)
      {
        const int vertex = triangles_[i].vertices[k];
        if (vertex >= count)
        {
          fail(triangles_[i].line,
               "face vertex " + std::to_string(vertex + 1) + "; the file has " + std::to_string(count) + " vertices");
        }
        mesh.triangles(k, static_cast<Eigen::Index>(i)) = vertex;
      }
    }
    return mesh;
  }

  struct Face
  {
    int vertices[3];
    int line;
  };

  std::string path_;
  int line_ = 0;
  std::vector<double> coordinates_;
  std::vector<Face> triangles_;
  std::vector<int> sorted_;
  std::vector<VertexGroup> groups_;
  std::unordered_map<std::string, std::size_t> group_places_;
  std::vector<std::size_t> current_;   ///< groups of the faces to come
};

}   // namespace

TriangleMesh readObj(const std::string& path) { return ObjReader(path).read(); }

std::vector<VertexGroup> readObjGroups(const std::string& path)
{
  ObjReader reader(path);
  reader.read();
  return reader.groups();
}

}   // namespace slender
