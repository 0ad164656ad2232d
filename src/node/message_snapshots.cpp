#include "message_snapshots.h"

#include <algorithm>
#include <set>

#include "slender_sim/node/bag_reader.h"
#include "slender_sim/node/converters.h"

namespace slender {
namespace {

Eigen::VectorXd numbers(const std::vector<double>& from)
{
  return Eigen::Map<const Eigen::VectorXd>(from.data(), static_cast<Eigen::Index>(from.size()));
}

std::vector<Eigen::Quaterniond> quaternions(const std::vector<geometry_msgs::Quaternion>& from)
{
  std::vector<Eigen::Quaterniond> out;
  for (const geometry_msgs::Quaternion& q : from)
    out.push_back(fromMessage(q));
  return out;
}

bool allFinite(const std::vector<Eigen::Quaterniond>& all)
{
  return std::all_of(all.begin(), all.end(), [](const Eigen::Quaterniond& q) { return q.coeffs().allFinite(); });
}

void requireFinite(bool finite, const std::string& what)
{
  if (!finite)
    throw BagError("a message of " + what + " has numbers that are not finite: the bag is damaged; copy it anew");
}

/// Returns the last mesh of these cloths that was recorded before them, or nullptr.
const slender_sim::MeshStamped* recordedMesh(const slender_sim::ClothState& cloths,
                                             const std::vector<slender_sim::MeshStamped>& meshes)
{
  const slender_sim::MeshStamped* found = nullptr;
  for (const slender_sim::MeshStamped& mesh : meshes)
    if (mesh.names == cloths.names && (!found || mesh.header.stamp <= cloths.header.stamp))
      found = &mesh;
  return found;
}

}   // namespace

void requireArrays(bool fits, const std::string& what)
{
  if (!fits)
    throw BagError("a message of " + what +
                   " has arrays that do not fit each other: the bag was not written by slender_sim, or is damaged");
}

void addSnapshot(const slender_sim::RodState& rod, const SceneConfig* scene, SceneSnapshot& out)
{
  const std::size_t nodes = rod.nodes.size(), edges = rod.frames.size();
  requireArrays(nodes >= 2 && edges == (rod.closed ? nodes : nodes - 1) && rod.velocities.size() == nodes &&
                    rod.twists.size() == nodes && rod.radii.size() == edges &&
                    (rod.radii_b.empty() || rod.radii_b.size() == edges),
                "rod " + rod.name);
  out.rods.push_back({rod.name, rod.closed != 0, columnsOf(rod.nodes), columnsOf(rod.velocities),
                      quaternions(rod.frames), numbers(rod.twists), numbers(rod.radii),
                      numbers(rod.radii_b.empty() ? rod.radii : rod.radii_b)});
  const RodSnapshot& read = out.rods.back();
  requireFinite(read.x.allFinite() && read.v.allFinite() && allFinite(read.frames) && read.twist.allFinite() &&
                    read.radius_a.allFinite() && read.radius_b.allFinite(),
                "rod " + rod.name);
  requireArrays(
      !scene || rod.guide_nodes.empty() ||
          appendFunctions(*scene, rod.name, "", columnsOf(rod.guide_nodes), columnsOf(rod.guide_forces), out.functions),
      "state (what " + rod.name + " tracks)");
}

void addSnapshot(const slender_sim::ThreadState& thread, SceneSnapshot& out)
{
  const std::size_t nodes = thread.nodes.size(), edges = thread.frames.size();
  requireArrays(nodes >= 2 && edges == nodes - 1 && thread.ids.size() == nodes && thread.velocities.size() == nodes &&
                    thread.deposited.size() == nodes && thread.radii.size() == edges,
                "thread " + thread.name);
  out.threads.push_back({thread.name, thread.thread_id, thread.ids, columnsOf(thread.nodes),
                         columnsOf(thread.velocities), thread.deposited, quaternions(thread.frames),
                         numbers(thread.radii)});
  const ThreadSnapshot& read = out.threads.back();
  requireFinite(read.x.allFinite() && read.v.allFinite() && allFinite(read.frames) && read.radius.allFinite(),
                "thread " + thread.name);
}

void addSnapshot(const slender_sim::ClothState& cloths, const std::vector<slender_sim::MeshStamped>& meshes,
                 const SceneConfig* scene, SceneSnapshot& out)
{
  const std::size_t count = cloths.names.size();
  requireArrays(cloths.offsets.size() == count && cloths.velocities.size() == cloths.vertices.size() &&
                    cloths.guide_offsets.size() == count && cloths.function_offsets.size() == count &&
                    cloths.function_sets.size() == count,
                "state");
  const auto range = [count](const std::vector<std::uint32_t>& offsets, std::size_t k, std::size_t size) {
    const std::size_t first = offsets[k], last = k + 1 < count ? offsets[k + 1] : size;
    requireArrays(first <= last && last <= size, "state");
    return std::pair(first, last);
  };
  for (std::size_t k = 0; k < count; ++k)
  {
    const auto [first, last] = range(cloths.offsets, k, cloths.vertices.size());
    ClothSnapshot cloth{
        cloths.names[k], columnsOf(cloths.vertices, first, last), columnsOf(cloths.velocities, first, last), {}};
    requireFinite(cloth.x.allFinite() && cloth.v.allFinite(), "cloth " + cloth.name);
    if (const slender_sim::MeshStamped* found = recordedMesh(cloths, meshes))
    {
      const slender_sim::MeshStamped& mesh = *found;
      const auto [from, to] = range(mesh.triangle_offsets, k, mesh.triangles.size() / 3);
      cloth.triangles.resize(3, static_cast<Eigen::Index>(to - from));
      for (std::size_t i = 3 * from; i < 3 * to; ++i)
      {
        requireArrays(mesh.triangles[i] >= first && mesh.triangles[i] < last, "mesh");
        cloth.triangles.data()[i - 3 * from] = static_cast<int>(mesh.triangles[i] - first);
      }
    }
    out.cloths.push_back(std::move(cloth));
    const auto [guide, guide_end] = range(cloths.guide_offsets, k, cloths.guide_vertices.size());
    const auto [force, force_end] = range(cloths.function_offsets, k, cloths.guide_forces.size());
    requireArrays(!scene || guide == guide_end ||
                      appendFunctions(*scene, cloths.names[k], cloths.function_sets[k],
                                      columnsOf(cloths.guide_vertices, guide, guide_end),
                                      columnsOf(cloths.guide_forces, force, force_end), out.functions),
                  "state (what " + cloths.names[k] + " tracks)");
  }
}

void addSnapshot(const slender_sim::BodyStates& states, std::vector<SolidSnapshot>& solids)
{
  requireArrays(states.pose.size() == states.name.size() && states.twist.size() == states.name.size(), "body_states");
  for (std::size_t b = 0; b < states.name.size(); ++b)
    solids.push_back({states.name[b],
                      recordedPose(states.pose[b]),
                      {fromMessage(states.twist[b].linear), fromMessage(states.twist[b].angular)}});
}

void addSnapshot(const slender_sim::Fields& fields, SceneSnapshot& out)
{
  // names of tables become names of files
  static const std::set<std::string> known{"rod_fields", "thread_fields", "cloth_fields", "solid_fields", "energies"};
  for (const slender_sim::FieldTable& from : fields.tables)
  {
    const std::size_t columns = from.columns.size(), rows = columns > 0 ? from.values.size() / columns : 0;
    requireArrays(known.count(from.table) > 0 && columns > 0 && from.values.size() == rows * columns,
                  "fields (of " + from.object + ")");
    FieldTable table{from.table, from.object, from.columns, Eigen::MatrixXd(rows, columns)};
    for (std::size_t i = 0; i < from.values.size(); ++i)
      table.values(static_cast<Eigen::Index>(i / columns), static_cast<Eigen::Index>(i % columns)) = from.values[i];
    out.fields.push_back(std::move(table));
  }
}

}   // namespace slender
