#include "gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>
#include <tiny_gltf.h>

#include "object_colors.h"
#include "slender_sim/geometry/mesh_offsets.h"

namespace slender {

namespace {

Eigen::Matrix3Xf normalsOf(const Eigen::Matrix3Xf& x, const Eigen::Matrix3Xi& triangles)
{
  return vertexNormals({x.cast<double>(), triangles}).cast<float>();
}

}   // namespace

class GltfWriter
{
public:
  explicit GltfWriter(const GltfAnimation& animation) : from_(animation)
  {
    model_.asset.version = "2.0";
    model_.asset.generator = "slender_sim bag_to_mesh";
    model_.buffers.emplace_back();
    tinygltf::Node root;
    root.name = "z_up";
    root.rotation = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    model_.nodes.push_back(root);
    tinygltf::Scene scene;
    scene.nodes = {0};
    model_.scenes.push_back(scene);
    model_.defaultScene = 0;
    motion_.name = "recorded";
    for (const auto& [object, parts] : from_.of_object_)
      for (std::size_t k = 0; k < parts.size(); ++k)
        addPart(from_.parts_[parts[k]], k, parts.size() > 1,
                k + 1 < parts.size() ? &from_.parts_[parts[k + 1]] : nullptr);
    if (!motion_.channels.empty())
      model_.animations.push_back(motion_);
  }

  void write(const std::string& path)
  {
    if (model_.buffers[0].data.size() > std::numeric_limits<std::uint32_t>::max() - (1u << 24))
      throw std::runtime_error(
          path + ": would be larger than the 4 GiB of a .glb file; take fewer frames (--fps) or sides (--sides)");
    tinygltf::TinyGLTF writer;
    std::ofstream file(path, std::ios::binary);   // the library's own does not tell that a disk is full
    const bool written = file && writer.WriteGltfSceneToStream(&model_, file, false, true);
    file.close();
    if (!written || !file)
      throw std::runtime_error(path + ": cannot be written; is there room on the disk?");
  }

private:
  int accessor(const float* data, std::size_t count, int type, bool bounds, int target = 0)
  {
    const int width = type == TINYGLTF_TYPE_VEC3 ? 3 : 1;
    tinygltf::Accessor a;
    a.bufferView = view(data, count * width * sizeof(float), target);
    a.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    a.count = count;
    a.type = type;
    if (bounds)
      for (int c = 0; c < width; ++c)
      {
        float low = data[c], high = data[c];
        for (std::size_t i = 0; i < count; ++i)
        {
          low = std::min(low, data[i * width + c]);
          high = std::max(high, data[i * width + c]);
        }
        a.minValues.push_back(low);
        a.maxValues.push_back(high);
      }
    model_.accessors.push_back(a);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  int vectors(const Eigen::Matrix3Xf& v, bool bounds)
  {
    return accessor(v.data(), static_cast<std::size_t>(v.cols()), TINYGLTF_TYPE_VEC3, bounds,
                    TINYGLTF_TARGET_ARRAY_BUFFER);
  }

  int numbers(const std::vector<float>& v, bool bounds = false)
  {
    return accessor(v.data(), v.size(), TINYGLTF_TYPE_SCALAR, bounds);
  }

  int view(const void* data, std::size_t bytes, int target)
  {
    std::vector<unsigned char>& buffer = model_.buffers[0].data;
    tinygltf::BufferView v;
    v.buffer = 0;
    v.byteOffset = buffer.size();
    v.byteLength = bytes;
    v.target = target;
    buffer.resize(buffer.size() + bytes);
    std::memcpy(buffer.data() + v.byteOffset, data, bytes);
    model_.bufferViews.push_back(v);
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  int materialOf(ObjectKind kind, int index)
  {
    const Eigen::Vector3d paint = objectColor(kind, index);
    tinygltf::Material material;
    // glTF wants linear light
    for (int c = 0; c < 3; ++c)
      material.pbrMetallicRoughness.baseColorFactor[c] = std::pow(paint[c], 2.2);
    material.pbrMetallicRoughness.metallicFactor = 0.0;
    material.pbrMetallicRoughness.roughnessFactor = 0.5;
    material.doubleSided = kind == ObjectKind::cloth;
    model_.materials.push_back(material);
    return static_cast<int>(model_.materials.size()) - 1;
  }

  void addPart(const GltfAnimation::Part& part, std::size_t number, bool several, const GltfAnimation::Part* next)
  {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = materialOf(part.kind, part.index);
    const std::vector<std::uint32_t> indices(part.triangles.data(), part.triangles.data() + part.triangles.size());
    tinygltf::Accessor a;
    a.bufferView = view(indices.data(), indices.size() * sizeof(std::uint32_t), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    a.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    a.count = indices.size();
    a.type = TINYGLTF_TYPE_SCALAR;
    model_.accessors.push_back(a);
    primitive.indices = static_cast<int>(model_.accessors.size()) - 1;
    const Eigen::Matrix3Xf& base = part.positions.front();
    const Eigen::Matrix3Xf normals = normalsOf(base, part.triangles);
    primitive.attributes["POSITION"] = vectors(base, true);
    primitive.attributes["NORMAL"] = vectors(normals, false);
    const bool moves =
        std::any_of(part.positions.begin(), part.positions.end(), [&](const Eigen::Matrix3Xf& x) { return x != base; });
    if (moves)
      for (std::size_t k = 1; k < part.positions.size(); ++k)
        primitive.targets.push_back(
            {{"POSITION", vectors(part.positions[k] - base, true)},
             {"NORMAL", vectors(normalsOf(part.positions[k], part.triangles) - normals, false)}});
    tinygltf::Mesh mesh;
    mesh.name = part.name + (several ? "." + std::to_string(number) : "");
    mesh.primitives.push_back(primitive);
    mesh.weights.assign(primitive.targets.size(), 0.0);
    model_.meshes.push_back(mesh);
    tinygltf::Node node;
    node.name = mesh.name;
    node.mesh = static_cast<int>(model_.meshes.size()) - 1;
    model_.nodes.push_back(node);
    const int at = static_cast<int>(model_.nodes.size()) - 1;
    model_.nodes[0].children.push_back(at);
    if (moves)
      animateShape(part, at);
    animateVisibility(part, at, next);
  }

  /// At each of its frames one target has all the weight; at the first none.
  void animateShape(const GltfAnimation::Part& part, int node)
  {
    const std::size_t count = part.frames.size();
    std::vector<float> times, weights(count * (count - 1), 0.0f);
    for (std::size_t k = 0; k < count; ++k)
    {
      times.push_back(static_cast<float>(from_.seconds_[part.frames[k]]));
      if (k > 0)
        weights[k * (count - 1) + k - 1] = 1.0f;
    }
    channel(node, "weights", "LINEAR", numbers(times, true), numbers(weights));
  }

  /// Seen from its first frame until its object's next part begins, or has no frame any more: nothing of size zero is.
  void animateVisibility(const GltfAnimation::Part& part, int node, const GltfAnimation::Part* next)
  {
    const std::size_t first = part.frames.front(), end = next ? next->frames.front() : part.frames.back() + 1,
                      frames = from_.seconds_.size();
    std::vector<float> times, scales;
    const auto key = [&](std::size_t frame, float scale) {
      times.push_back(static_cast<float>(from_.seconds_[frame]));
      scales.insert(scales.end(), 3, scale);
    };
    if (first == 0 && end >= frames)
      return;
    if (first > 0)
      key(0, 0.0f);
    key(first, 1.0f);
    if (end < frames)
      key(end, 0.0f);
    channel(node, "scale", "STEP", numbers(times, true),
            accessor(scales.data(), times.size(), TINYGLTF_TYPE_VEC3, false));
    model_.nodes[node].scale.assign(3, first == 0 ? 1.0 : 0.0);
  }

  void channel(int node, const char* path, const char* interpolation, int input, int output)
  {
    tinygltf::AnimationSampler sampler;
    sampler.input = input;
    sampler.output = output;
    sampler.interpolation = interpolation;
    motion_.samplers.push_back(sampler);
    tinygltf::AnimationChannel c;
    c.sampler = static_cast<int>(motion_.samplers.size()) - 1;
    c.target_node = node;
    c.target_path = path;
    motion_.channels.push_back(c);
  }

  const GltfAnimation& from_;
  tinygltf::Model model_;
  tinygltf::Animation motion_;
};

void GltfAnimation::add(double seconds, const std::vector<ObjectMesh>& objects)
{
  const std::size_t frame = seconds_.size();
  seconds_.push_back(seconds);
  for (const ObjectMesh& object : objects)
  {
    std::vector<std::size_t>& parts = of_object_[{object.kind, object.name}];
    if (parts.empty() || parts_[parts.back()].key != object.key ||
        parts_[parts.back()].triangles != object.mesh.triangles)
    {
      parts.push_back(parts_.size());
      parts_.push_back({object.kind, object.name, object.index, object.key, object.mesh.triangles, {}, {}});
    }
    Part& part = parts_[parts.back()];
    part.frames.push_back(frame);
    part.positions.push_back(object.mesh.vertices.cast<float>());
  }
}

void GltfAnimation::write(const std::string& path) const { GltfWriter(*this).write(path); }

}   // namespace slender
