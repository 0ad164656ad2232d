#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "arguments.h"
#include "export_program.h"
#ifdef SLENDER_WITH_GLTF
#include "gltf_animation.h"
#endif
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/recorder.h"
#include "slender_sim/scene/snapshot_meshes.h"

/// bag_to_mesh BAG --out DIR|FILE.glb: surfaces of what was recorded, for other programs.
namespace {

using slender::BadInput;
using slender::ObjectMesh;

const char* const name = "bag_to_mesh";
const char* const usage =
    "usage: bag_to_mesh BAG --out PATH [options]\n"
    "  --out PATH       obj, ply: new or empty folder for frame_000000.obj ...; glb: file\n"
    "  --format F       obj: a file per frame, an object per rod, thread, cloth, body; ply: likewise, all of them one "
    "mesh;\n"
    "                   glb: one animated file, e.g. for Blender (default: glb when PATH ends in .glb, else obj)\n"
    "  --fps N          frames per recorded second (default: obj, ply every recorded instant; glb 25)\n"
    "  --sides N        of the tubes around rods and threads (default 16)\n"
    "  --namespace NS   of the recorded topics, e.g. /rod_node; needed for a bag of several nodes\n"
    "  --scene-dir DIR  where the files lie that the recorded scene names (default: here); needed for bodies and "
    "obstacles\n"
    "  --quiet          print nothing but errors\n"
    "Exit status: 0 done, 2 bad input, 3 writing failed.\n";

slender::TriangleMesh joined(const std::vector<ObjectMesh>& objects)
{
  Eigen::Index vertices = 0, triangles = 0;
  for (const ObjectMesh& object : objects)
  {
    vertices += object.mesh.vertices.cols();
    triangles += object.mesh.triangles.cols();
  }
  slender::TriangleMesh out{Eigen::Matrix3Xd(3, vertices), Eigen::Matrix3Xi(3, triangles)};
  vertices = triangles = 0;
  for (const ObjectMesh& object : objects)
  {
    const slender::TriangleMesh& mesh = object.mesh;
    out.vertices.middleCols(vertices, mesh.vertices.cols()) = mesh.vertices;
    out.triangles.middleCols(triangles, mesh.triangles.cols()) = mesh.triangles.array() + static_cast<int>(vertices);
    vertices += mesh.vertices.cols();
    triangles += mesh.triangles.cols();
  }
  return out;
}

/// The meshes of the instants that become frames.
void eachFrame(const slender::ExportOptions& options, slender::BagReader& bag, double fps, int sides,
               const std::function<void(const slender::SceneSnapshot&, const std::vector<ObjectMesh>&)>& use)
{
  slender::FrameChoice choice(fps);
  slender::TubeResolution resolution;
  resolution.sides = sides;
  slender::eachInstant(name, options, bag, [&](const slender::SceneSnapshot& instant) {
    if (choice.takes(bag.seconds()))
      use(instant, slender::objectMeshes(instant, bag.scene(), resolution));
  });
}

}   // namespace

int main(int argc, char** argv)
{
  std::string format;
  std::optional<double> fps;
  int sides = slender::TubeResolution().sides;
  const std::map<std::string, slender::OptionTaker> own = {
      {"--format",
       [&](const std::string& option, const std::string& value) {
         if (value != "obj" && value != "ply" && value != "glb")
           throw BadInput(option + " " + value + ": must be obj, ply or glb");
         format = value;
       }},
      {"--fps",
       [&](const std::string& option, const std::string& value) { fps = slender::parsePositive(option, value, 1e6); }},
      {"--sides", [&](const std::string& option,
                      const std::string& value) { sides = slender::parseCount(option, value, 3, 256); }},
  };
  return slender::exportProgram(name, usage, argc, argv, own, [&](const slender::ExportOptions& options) {
    const std::string& out = options.out;
    if (format.empty())
    {
      std::string suffix = std::filesystem::path(out).extension().string();
      std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
      format = suffix == ".glb" ? "glb" : "obj";
    }
    slender::BagReader bag = slender::openBag(name, options, "bodies and obstacles are left out,");
    if (format == "glb")
    {
#ifdef SLENDER_WITH_GLTF
      slender::Staged file(slender::Staged::Kind::file, out);
      slender::GltfAnimation animation;
      eachFrame(options, bag, fps.value_or(25.0), sides,
                [&](const auto&, const auto& objects) { animation.add(bag.seconds(), objects); });
      animation.write(file.part());
      file.keep();
      return;
#else
      throw BadInput("--format glb: this build has no tinygltf; install libtinygltf-dev and build anew, or use obj or ply");
#endif
    }
    slender::Staged folder(slender::Staged::Kind::folder, out);
    long frame = 0;
    eachFrame(options, bag, fps.value_or(0.0), sides,
              [&](const slender::SceneSnapshot& instant, const std::vector<ObjectMesh>& objects) {
                char file[40];
                std::snprintf(file, sizeof file, "/frame_%06ld.%s", frame++, format.c_str());
                if (format == "ply")
                {
                  slender::writePly(folder.part() + file, joined(objects));
                  return;
                }
                std::vector<slender::ObjObject> parts;
                for (const ObjectMesh& object : objects)
                  parts.push_back({object.name, object.mesh, {}});
                slender::writeObj(folder.part() + file,
                                  slender::objComment(bag.scene() ? bag.scene()->name : options.bag, instant.time),
                                  parts);
              });
    folder.keep();
  });
}
