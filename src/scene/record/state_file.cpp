#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <unistd.h>

#include "byte_archive.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/scene/state_bytes.h"
#include "state_file.h"

/// Saving and loading of a simulation's state. The file: magic, version, fingerprint of the scene, size and checksum of
/// the payload, payload; numbers as this machine keeps them (the magic number tells the byte order).
namespace slender {

namespace {

constexpr std::uint64_t magic = 0x4554415453444f52u;   // "RODSTATE" in little-endian bytes
constexpr std::uint64_t version = 21;
constexpr std::size_t header_size = 5 * sizeof(std::uint64_t);

std::string errorText(const std::string& path, const std::string& what)
{
  return path + ": " + what + ": " + std::strerror(errno);
}

/// Writes all bytes to a temporary file beside `wanted` and then takes its place, so that there is never half a file.
void writeDurably(const std::string& wanted, const std::string& bytes)
{
  const std::string path = replaceablePath(wanted);
  const std::string temporary = path + ".tmp" + std::to_string(::getpid());
  ::unlink(temporary.c_str());   // of a process that was killed
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (file < 0)
    throw std::runtime_error(errorText(path, "cannot be written there"));
  std::size_t written = 0;
  bool good = true;
  while (good && written < bytes.size())
  {
    const ssize_t count = ::write(file, bytes.data() + written, bytes.size() - written);
    good = count > 0 || (count < 0 && errno == EINTR);
    written += count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  good = good && ::fsync(file) == 0;
  const int error = errno;
  const bool closed = ::close(file) == 0;
  if (!good || !closed || std::rename(temporary.c_str(), path.c_str()) != 0)
  {
    errno = good ? errno : error;
    const std::string text = errorText(path, "cannot be written");
    ::unlink(temporary.c_str());
    throw std::runtime_error(text);
  }
  const auto slash = path.find_last_of('/');
  const int folder =
      ::open(slash == std::string::npos ? "." : path.substr(0, slash + 1).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0)
  {
    ::fsync(folder);   // makes the new name durable too, where the file system can
    ::close(folder);
  }
}

/// Empty, or what does not fit between a loaded rod, its model and the rod as it is now.
std::string misfit(const RodState& rod, const RodModel& model, const RodState& now)
{
  const Eigen::Index n = model.nodes();
  if (rod.x.cols() != n || rod.v.cols() != n)
    return "rod " + model.name + " has another number of nodes";
  if (!framesFit(model, rod) || !(rod.framed() || doesWithoutFrames(model)))
    return "rod " + model.name + " has material frames, or a director instead of them, that do not fit it";
  for (const auto* memory : {&rod.a, &rod.x_previous, &rod.v_previous})
    if (memory->cols() != 0 && memory->cols() != n)
      return "rod " + model.name + " has integrator memory of another size";
  if (rod.grasps.size() != now.grasps.size())
    return "rod " + model.name + " has another number of grasps";
  for (std::size_t g = 0; g < rod.grasps.size(); ++g)
  {
    const GraspState& grasp = rod.grasps[g];
    if (grasp.first_node < 0 || grasp.first_node > grasp.last_node || grasp.last_node >= n)
      return "a grasp of rod " + model.name + " holds nodes that do not exist";
    const auto edges = static_cast<std::size_t>(grasp.last_node - grasp.first_node);
    if (grasp.nodes_G.size() != edges + 1 || grasp.directors_G.size() != edges || (edges > 0 && !grasp.holds_frame) ||
        grasp.body != now.grasps[g].body)
      return "a grasp of rod " + model.name + " does not fit together";
  }
  return "";
}

/// Likewise of a thread.
bool fits(const ThreadState& thread)
{
  const std::size_t nodes = thread.x.size(), edges = thread.volume.size();
  return nodes >= 2 && edges + 1 == nodes && thread.v.size() == nodes && thread.twist.size() == nodes &&
         thread.id.size() == nodes && thread.deposited.size() == nodes && thread.d1.size() == edges &&
         thread.spin.size() == edges;
}

/// Likewise of cloth number k: the stepper checks the rest.
bool fits(const SceneState& loaded, const SceneState& now, std::size_t k, const ClothModel& model)
{
  const ClothState &cloth = loaded.cloths[k], &cloth_now = now.cloths[k];
  const std::vector<ClothGrasp>& grasps = loaded.cloth_grasps[k];
  const PrescribedAverages* averages = model.averagesOf(cloth);
  bool good = cloth.x.cols() == cloth_now.x.cols() && cloth.v.cols() == cloth_now.v.cols() &&
              cloth.rest_angles.size() == cloth_now.rest_angles.size() &&
              cloth.stiffening.size() == cloth_now.stiffening.size() && grasps.size() == now.cloth_grasps[k].size() &&
              (averages || cloth.average_set == 0);
  if (!now.cloth_guides.empty())
  {
    const GuideState &guide = loaded.cloth_guides[k], &guide_now = now.cloth_guides[k];
    const Eigen::Index count = averages ? averages->count() : 0;
    const bool blends = guide.blend.gap.cols() > 0;
    good = good && guide.points.cols() == guide_now.points.cols() &&
           guide.velocity.cols() == guide_now.velocity.cols() && guide.forces.cols() == count &&
           guide.blend.gap.cols() == (blends ? count : 0) && guide.blend.rate.cols() == guide.blend.gap.cols() &&
           (guide.blend.duration > 0) == blends;
  }
  const auto there = [&cloth](int vertex) { return vertex >= 0 && vertex < cloth.x.cols(); };
  good = good && std::all_of(cloth.pins.begin(), cloth.pins.end(), there);
  std::size_t pins = 0;
  for (const ClothGrasp& grasp : grasps)
  {
    good = good && static_cast<std::size_t>(grasp.points_G.cols()) == grasp.vertices.size() &&
           std::all_of(grasp.vertices.begin(), grasp.vertices.end(), there);
    pins += grasp.active ? grasp.vertices.size() : 0;
  }
  return good && pins == cloth.pins.size();
}

/// The state in the bytes of a whole file. Throws std::runtime_error that says what is wrong with the file.
SceneState stateOfFile(const std::string& bytes, std::uint64_t fingerprint)
{
  std::uint64_t header[5] = {};
  ByteReader reader(bytes.data(), bytes.size());
  if (bytes.size() >= sizeof(std::uint64_t))
    reader(header[0]);
  if (header[0] != magic)
    throw std::runtime_error("is not a saved state (of a machine with this byte order)");
  if (bytes.size() < header_size)
    throw std::runtime_error("ends too early");
  for (int k = 1; k < 5; ++k)
    reader(header[k]);
  if (header[1] != version)
  {
    throw std::runtime_error("has format version " + std::to_string(header[1]) + "; this program reads version " +
                             std::to_string(version));
  }
  if (header[3] != reader.left())
  {
    throw std::runtime_error("has " + std::to_string(reader.left()) + " bytes of state; its header says " +
                             std::to_string(header[3]));
  }
  Checksum checksum;
  checksum.add(bytes.data() + header_size, bytes.size() - header_size);
  if (header[4] != checksum.value())
    throw std::runtime_error("is damaged (its checksum does not fit)");
  if (header[2] != fingerprint)
  {
    throw std::runtime_error(
        "belongs to another scene (rods, moduli, grasps, threads, cloths, gravity, step and integrator must be the "
        "same)");
  }
  return stateOfBytes(bytes.data() + header_size, reader.left());
}

}   // namespace

std::string misfit(const SceneState& loaded, const SceneState& now, const WorldModel& world)
{
  const auto sizes = [](const SceneState& s) {
    return std::array{
        s.rods.size(),           s.rod_guides.size(),          s.threads.size(),       s.end_loads.size(),
        s.cloths.size(),         s.cloth_guides.size(),        s.cloth_grasps.size(),  s.bodies.size(),
        s.obstacles.size(),      s.obstacle_velocities.size(), s.contact.rods.size(),  s.contact.threads.size(),
        s.contact.bodies.size(), s.contact.cloths.size(),      s.grasp_offsets.size(), s.wrenches.size()};
  };
  if (sizes(loaded) != sizes(now))
    return "has another number of rods, threads, cloths, bodies, obstacles or grasps";
  std::string problem;
  for (std::size_t r = 0; problem.empty() && r < now.rods.size(); ++r)
    problem = misfit(loaded.rods[r], *world.rods[r].model, now.rods[r]);
  for (std::size_t r = 0; problem.empty() && r < now.rod_guides.size(); ++r)
  {
    const GuideState &guide = loaded.rod_guides[r], &guide_now = now.rod_guides[r];
    if (guide.points.cols() != guide_now.points.cols() || guide.forces.cols() != guide_now.forces.cols())
      problem = "the guide of rod " + world.rods[r].model->name + " has another size";
  }
  for (std::size_t k = 0; problem.empty() && k < now.threads.size(); ++k)
  {
    const auto& threads = loaded.threads[k].threads;
    const ThreadModel& model = *world.threads[k].model;
    // a thread that nothing holds may have left its region
    const bool gone = threads.empty() && model.nozzle_diameter > 0;
    if (gone || !std::all_of(threads.begin(), threads.end(), [](const ThreadState& thread) { return fits(thread); }))
      problem = "thread " + model.name + " does not fit together";
  }
  for (std::size_t k = 0; problem.empty() && k < now.cloths.size(); ++k)
    if (!fits(loaded, now, k, *world.cloths[k].model))
      problem = "cloth " + world.cloths[k].model->name + " does not fit together";
  return problem;
}

void Simulation::save(const std::string& path) const
{
  const std::string payload = stateBytes(state_);
  Checksum checksum;
  checksum.add(payload.data(), payload.size());
  ByteWriter file;
  for (std::uint64_t word : {magic, version, stateFingerprint(config_, world_->model()),
                             static_cast<std::uint64_t>(payload.size()), checksum.value()})
    file(word);
  writeDurably(path, file.bytes() + payload);
}

void Simulation::load(const std::string& path)
{
  requireRegularFile(path);
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(errorText(path, "cannot be opened for reading"));
  std::ostringstream text;
  text << file.rdbuf();
  const std::string bytes = text.str();
  SceneState loaded;
  try
  {
    if (file.bad() || bytes.empty())
      throw std::runtime_error("is empty or cannot be read");
    loaded = stateOfFile(bytes, stateFingerprint(config_, world_->model()));
    if (const std::string problem = misfit(loaded, state_, world_->model()); !problem.empty())
      throw std::runtime_error(problem);
    world_->checkCloths(loaded);
  }
  catch (const std::exception& error)
  {
    throw std::runtime_error(path + ": " + error.what());
  }
  state_ = std::move(loaded);
  world_->forgetContacts();
}

}   // namespace slender
