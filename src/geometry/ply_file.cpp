#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "slender_sim/geometry/mesh_file.h"

namespace slender {

namespace {

struct PlyType
{
  const char *name, *other_name;
  int size;
  bool is_signed, is_float;
};
constexpr PlyType kTypes[] = {{"char", "int8", 1, true, false},    {"uchar", "uint8", 1, false, false},
                              {"short", "int16", 2, true, false},  {"ushort", "uint16", 2, false, false},
                              {"int", "int32", 4, true, false},    {"uint", "uint32", 4, false, false},
                              {"float", "float32", 4, true, true}, {"double", "float64", 8, true, true}};

struct PlyProperty
{
  std::string name;
  const PlyType* type = nullptr;
  const PlyType* count_type = nullptr;   ///< of lists
};
struct PlyElement
{
  std::string name;
  long count = 0;
  std::vector<PlyProperty> properties;
};

class PlyReader
{
public:
  explicit PlyReader(const std::string& path) : path_(path) {}

  TriangleMesh read()
  {
    std::ifstream file(path_, std::ios::binary);
    if (!file)
      fail("cannot be opened");
    data_.assign(std::istreambuf_iterator<char>(file), {});
    if (file.bad())
      fail("cannot be read");
    readHeader();
    for (const PlyElement& element : elements_)
    {
      checkElement(element);
      for (long i = 0; i < element.count && !element.properties.empty();
           ++i)   // else nothing of it is in the file, however many there are
        readItem(element, i);
    }
    return finish();
  }

private:
  [[noreturn]] void fail(const std::string& reason) const { throw std::runtime_error(path_ + ": " + reason); }

  std::string headerLine()
  {
    const std::size_t end = data_.find('\n', at_);
    if (end == std::string::npos)
      fail("the header has no end (end_header)");
    std::string line = data_.substr(at_, end - at_);
    at_ = end + 1;
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    return line;
  }

  const PlyType* type(const std::string& name) const
  {
    for (const PlyType& t : kTypes)
      if (name == t.name || name == t.other_name)
        return &t;
    fail("header: unknown type '" + name + "'");
  }

  void readHeader()
  {
    if (headerLine() != "ply")
      fail("is not a PLY file: the first line must be 'ply'");
    std::string format;
    for (std::string line = headerLine(); line != "end_header"; line = headerLine())
    {
      std::istringstream words(line);
      std::string key, first, second, third;
      words >> key;
      if (key == "format")
        words >> format;
      else if (key == "element")
      {
        PlyElement element;
        if (!(words >> element.name >> element.count) || element.count < 0 || element.count > 1'000'000'000)
          fail("header: '" + line + "'; must be element NAME COUNT");
        elements_.push_back(element);
      }
      else if (key == "property")
      {
        PlyProperty property;
        words >> first >> second;
        if (first == "list")
        {
          words >> third;
          property.count_type = type(second);
          property.type = type(third);
          words >> property.name;
        }
        else
        {
          property.type = type(first);
          property.name = second;
        }
        if (elements_.empty() || property.name.empty())
          fail("header: '" + line + "'; must be property [list TYPE] TYPE NAME after an element");
        elements_.back().properties.push_back(property);
      }
    }
    ascii_ = format == "ascii";
    big_endian_ = format == "binary_big_endian";
    if (!ascii_ && !big_endian_ && format != "binary_little_endian")
      fail("header: format '" + format + "'; must be ascii, binary_little_endian or binary_big_endian");
  }

  void checkElement(const PlyElement& element) const
  {
    const auto has = [&](const char* name, bool list) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const PlyProperty& p) { return p.name == name && (p.count_type != nullptr) == list; });
    };
    if (element.name == "vertex" && !(has("x", false) && has("y", false) && has("z", false)))
      fail("header: element vertex has no properties x, y, z");
    if (element.name == "face" && !has("vertex_indices", true) && !has("vertex_index", true))
      fail("header: element face has no property list vertex_indices");
  }

  double number(const PlyType& t)
  {
    if (ascii_)
    {
      while (at_ < data_.size() && std::isspace(static_cast<unsigned char>(data_[at_])))
        ++at_;
      const std::size_t begin = at_;
      while (at_ < data_.size() && !std::isspace(static_cast<unsigned char>(data_[at_])))
        ++at_;
      if (begin == at_)
        fail("ends early");
      double value = 0.0;
      const char* from = data_.data() + begin + (data_[begin] == '+');
      const auto result = std::from_chars(from, data_.data() + at_, value);
      if (result.ec != std::errc() || result.ptr != data_.data() + at_)
        fail("'" + data_.substr(begin, at_ - begin) + "' is not a number");
      return value;
    }
    if (at_ + t.size > data_.size())
      fail("ends early");
    std::uint64_t bits = 0;
    for (int k = 0; k < t.size; ++k)
      bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(data_[at_ + (big_endian_ ? t.size - 1 - k : k)]))
              << (8 * k);
    at_ += t.size;
    if (t.is_float && t.size == 8)
    {
      double value;
      std::memcpy(&value, &bits, 8);
      return value;
    }
    if (t.is_float)
    {
      const auto narrow = static_cast<std::uint32_t>(bits);
      float value;
      std::memcpy(&value, &narrow, 4);
      return value;
    }
    const int unused = 64 - 8 * t.size;
    return t.is_signed ? static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused)
                       : static_cast<double>(bits);
  }

  void readItem(const PlyElement& element, long i)
  {
    const bool vertex = element.name == "vertex", face = element.name == "face";
    double x[3] = {};
    for (const PlyProperty& property : element.properties)
    {
      if (!property.count_type)
      {
        const double value = number(*property.type);
        if (vertex && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
        {
          if (!std::isfinite(value))
            fail("vertex " + std::to_string(i) + " (from 0) is not finite");
          x[property.name[0] - 'x'] = value;
        }
        continue;
      }
      const double count = number(*property.count_type);
      if (!(count >= 0) || count > 1e9 || count != std::floor(count))
        fail(element.name + " " + std::to_string(i) + " (from 0): list of bad length");
      const bool wanted = face && (property.name == "vertex_indices" || property.name == "vertex_index");
      polygon_.clear();
      for (long k = 0; k < static_cast<long>(count); ++k)
      {
        const double value = number(*property.type);
        if (wanted)
          polygon_.push_back(value);
      }
      if (wanted)
        addPolygon(i);
    }
    if (vertex)
      coordinates_.insert(coordinates_.end(), x, x + 3);
  }

  void addPolygon(long i)
  {
    const std::string name = "face " + std::to_string(i) + " (from 0)";
    if (polygon_.size() < 3)
      fail(name + " with " + std::to_string(polygon_.size()) + " vertices; must have at least 3");
    if (!std::all_of(polygon_.begin(), polygon_.end(),
                     [](double v) { return v >= 0 && v < 1e9 && v == std::floor(v); }))   // NaN has no order
      fail(name + " names a vertex that the file does not have");
    std::vector<double> sorted = polygon_;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      fail(name + " has a vertex twice");
    for (std::size_t k = 2; k < polygon_.size(); ++k)
      for (const double v : {polygon_[0], polygon_[k - 1], polygon_[k]})
        corners_.push_back(static_cast<int>(v));
  }

  TriangleMesh finish() const
  {
    if (corners_.empty())
      fail("has no faces");
    TriangleMesh mesh;
    const auto count = static_cast<Eigen::Index>(coordinates_.size() / 3);
    if (*std::max_element(corners_.begin(), corners_.end()) >= count)
      fail("a face names a vertex that the file does not have: there are " + std::to_string(count));
    mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(coordinates_.data(), 3, count);
    mesh.triangles =
        Eigen::Map<const Eigen::Matrix3Xi>(corners_.data(), 3, static_cast<Eigen::Index>(corners_.size() / 3));
    return mesh;
  }

  std::string path_, data_;
  std::size_t at_ = 0;
  bool ascii_ = false, big_endian_ = false;
  std::vector<PlyElement> elements_;
  std::vector<double> coordinates_, polygon_;
  std::vector<int> corners_;
};

bool endsWith(const std::string& path, const char* end)
{
  const std::size_t n = std::strlen(end);
  return path.size() >= n && std::equal(end, end + n, path.end() - n, [](char a, char b) {
           return std::tolower(static_cast<unsigned char>(b)) == a;
         });
}

[[noreturn]] void refuseName(const std::string& path)
{
  throw std::runtime_error(path + ": the name of a mesh file must end in .obj or .ply");
}

void finishWriting(std::ofstream& file, const std::string& path)
{
  file.close();
  if (!file)
    throw std::runtime_error(path + ": cannot be written");
}

}   // namespace

TriangleMesh readPly(const std::string& path) { return PlyReader(path).read(); }

TriangleMesh readMesh(const std::string& path)
{
  if (endsWith(path, ".obj"))
    return readObj(path);
  if (endsWith(path, ".ply"))
    return readPly(path);
  refuseName(path);
}

namespace {

/// The file counts from 1, over all objects: `first` vertices stand before.
void putObj(std::ofstream& file, const TriangleMesh& mesh, Eigen::Index first)
{
  std::string line;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    line = "v";
    for (int k = 0; k < 3; ++k)
    {
      char digits[40];
      const auto end = std::to_chars(digits, digits + sizeof digits, mesh.vertices(k, i)).ptr;
      line.append(" ").append(digits, end);
    }
    file << line << '\n';
  }
  const Eigen::Index base = first + 1;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    file << "f " << base + mesh.triangles(0, f) << ' ' << base + mesh.triangles(1, f) << ' '
         << base + mesh.triangles(2, f) << '\n';
}

}   // namespace

void writeObj(const std::string& path, const TriangleMesh& mesh)
{
  std::ofstream file(path, std::ios::binary);
  putObj(file, mesh, 0);
  finishWriting(file, path);
}

void writeObj(const std::string& path, const std::string& comment, const std::vector<ObjObject>& objects)
{
  std::ofstream file(path, std::ios::binary);
  file << "# ";
  for (const char c : comment)
    file << (c == '\n' || c == '\r' ? ' ' : c);
  file << '\n';
  Eigen::Index first = 0;
  for (const ObjObject& object : objects)
  {
    file << "o " << object.name << '\n';
    putObj(file, object.mesh, first);
    if (!object.line.empty())
    {
      file << 'l';
      for (const int vertex : object.line)
        file << ' ' << first + 1 + vertex;
      file << '\n';
    }
    first += object.mesh.vertices.cols();
  }
  finishWriting(file, path);
}

void writePly(const std::string& path, const TriangleMesh& mesh)
{
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.cols()
       << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << mesh.triangles.cols()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](std::uint64_t bits, int bytes) {
    for (int k = 0; k < bytes; ++k)
      file.put(static_cast<char>(bits >> (8 * k)));
  };
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i)
  {
    std::uint64_t bits;
    std::memcpy(&bits, mesh.vertices.data() + i, 8);
    put(bits, 8);
  }
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    put(3, 1);
    for (int k = 0; k < 3; ++k)
      put(static_cast<std::uint32_t>(mesh.triangles(k, f)), 4);
  }
  finishWriting(file, path);
}

void writeColoredMesh(const std::string& path, const TriangleMesh& mesh, const Eigen::Matrix3Xd& colors)
{
  requireMeshName(path);
  const bool ply = endsWith(path, ".ply");
  std::ofstream file(path, std::ios::binary);
  if (ply)
    file << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.cols()
         << "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar "
            "green\nproperty uchar blue\nelement face "
         << mesh.triangles.cols() << "\nproperty list uchar int vertex_indices\nend_header\n";
  char line[160];
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const Eigen::Vector3d x = mesh.vertices.col(i), c = colors.col(i).cwiseMax(0.0).cwiseMin(1.0);
    if (ply)
      std::snprintf(line, sizeof line, "%.17g %.17g %.17g %d %d %d\n", x[0], x[1], x[2],
                    static_cast<int>(std::lround(255 * c[0])), static_cast<int>(std::lround(255 * c[1])),
                    static_cast<int>(std::lround(255 * c[2])));
    else
      std::snprintf(line, sizeof line, "v %.17g %.17g %.17g %.4f %.4f %.4f\n", x[0], x[1], x[2], c[0], c[1], c[2]);
    file << line;
  }
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = mesh.triangles.col(f).array() + (ply ? 0 : 1);
    file << (ply ? "3 " : "f ") << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  }
  finishWriting(file, path);
}

void requireMeshName(const std::string& path)
{
  if (!endsWith(path, ".obj") && !endsWith(path, ".ply"))
    refuseName(path);
}

void writeMesh(const std::string& path, const TriangleMesh& mesh)
{
  if (endsWith(path, ".obj"))
    return writeObj(path, mesh);
  if (endsWith(path, ".ply"))
    return writePly(path, mesh);
  refuseName(path);
}

}   // namespace slender
