#include "slender_sim/scene/recorder.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <numeric>

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/csv_tables.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {

namespace {

class CsvRecorder final : public Recorder
{
public:
  explicit CsvRecorder(const std::string& folder) : folder_(folder), tables_(folder) {}
  void record(const Simulation& simulation, const StepReport&) override
  {
    guarded([&] { tables_.write(snapshotOf(simulation), simulation.config().record.nodes); });
  }
  void finish() override
  {
    guarded([&] { tables_.finish(); });
  }

private:
  template <class Write>
  void guarded(const Write& write) const
  {
    try
    {
      write();
    }
    catch (const std::runtime_error& error)
    {
      throw WriteError(std::string(error.what()) + "; the tables in " + folder_ + " are cut off");
    }
  }

  std::string folder_;
  CsvTables tables_;
};

std::vector<int> polyline(Eigen::Index nodes, bool closed)
{
  std::vector<int> line(static_cast<std::size_t>(nodes));
  std::iota(line.begin(), line.end(), 0);
  if (closed)
    line.push_back(0);
  return line;
}

/// frame_000000.obj and so on.
bool isFrameName(const std::string& name)
{
  const std::string start = "frame_", end = ".obj";
  const std::size_t digits = name.size() - std::min(name.size(), start.size() + end.size());
  return digits >= 6 && name.compare(0, start.size(), start) == 0 &&
         name.compare(name.size() - end.size(), end.size(), end) == 0 &&
         name.find_first_not_of("0123456789", start.size()) == name.size() - end.size();
}

class ObjRecorder final : public Recorder
{
public:
  explicit ObjRecorder(std::string folder) : folder_(std::move(folder))
  {
    makeFolder(folder_);
    clearEarlierRun(folder_, isFrameName, "# scene ");
  }

  void record(const Simulation& simulation, const StepReport&) override
  {
    const SceneSnapshot instant = snapshotOf(simulation);
    std::vector<ObjObject> objects;
    for (const RodSnapshot& rod : instant.rods)
      objects.push_back({rod.name, {rod.x, {}}, polyline(rod.x.cols(), rod.closed)});
    for (const ThreadSnapshot& thread : instant.threads)
      objects.push_back({thread.name, {thread.x, {}}, polyline(thread.x.cols(), false)});
    for (const ClothSnapshot& cloth : instant.cloths)
      objects.push_back({cloth.name, {cloth.x, cloth.triangles}, {}});
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%06ld.obj", frame_);
    const std::string part = folder_ + name + ".part";   // so that there is never half a frame
    try
    {
      const std::string path = replaceablePath(folder_ + name);
      writeObj(part, objComment(simulation.config().name, instant.time), objects);
      std::filesystem::rename(part, path);
    }
    catch (const std::runtime_error& error)
    {
      std::remove(part.c_str());
      throw WriteError(std::string(error.what()) + "; " + std::to_string(frame_) + " whole files are before it");
    }
    ++frame_;
  }

  void finish() override {}

private:
  std::string folder_;
  long frame_ = 0;
};

}   // namespace

std::string objComment(const std::string& scene, double time)
{
  char digits[40];
  const auto end = std::to_chars(digits, digits + sizeof digits, time).ptr;
  return "scene " + scene + ", t = " + std::string(digits, end) + " s; lengths in m";
}

std::unique_ptr<Recorder> makeCsvRecorder(const std::string& folder) { return std::make_unique<CsvRecorder>(folder); }

std::unique_ptr<Recorder> makeObjRecorder(const std::string& folder) { return std::make_unique<ObjRecorder>(folder); }

}   // namespace slender
