#include <cstdio>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "export_program.h"
#include "harness.h"
#include "holder_meshes.h"
#include "picture.h"
#include "video_file.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/node/bag_reader.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/snapshot_meshes.h"
#ifdef SLENDER_WITH_GLTF
#include <tiny_gltf.h>
#endif

/// simulate --bag, then every exporter. No master is needed.
namespace slender {
namespace {

struct Recording
{
  const char *scene, *options;
  std::set<std::string> tables;
};

class Tables : public Exports, public testing::WithParamInterface<Recording>
{};

TEST_P(Tables, areThoseOfTheRunItself)
{
  const Recording& recording = GetParam();
  const std::string bag = record(recording.scene, std::string(recording.options) + " --csv " + path("direct"));
  expectExported(csv + " " + bag + " --quiet --scene-dir " + source + "/config/scenes --out " + path("exported"));
  ASSERT_EQ(namesIn(path("direct")), recording.tables);
  ASSERT_EQ(namesIn(path("exported")), recording.tables);
  for (const std::string& table : recording.tables)
  {
    const std::string direct = contentsOf(path("direct/" + table));
    EXPECT_TRUE(direct == contentsOf(path("exported/" + table))) << table;
    EXPECT_EQ(direct.find("nan"), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Tables,
    testing::Values(Recording{"demo_rope", "--duration 0.1", {"nodes.csv", "grasps.csv"}},
                    Recording{"honey_coil",
                              "--duration 1.2 --set 'record.fields=[curvature, strain, force]'",
                              {"nodes.csv", "grasps.csv", "threads.csv", "thread_fields.csv"}},
                    Recording{"honey_on_cable", "--duration 0.1", {"nodes.csv", "grasps.csv", "threads.csv"}},
                    Recording{"handkerchief", "--duration 0.1", {"nodes.csv", "grasps.csv", "cloths.csv"}},
                    Recording{"obstacle_course",
                              "--duration 0.1 --set 'record.fields=[force, moment, energy, contact_force]'",
                              {"nodes.csv", "grasps.csv", "bodies.csv", "rod_fields.csv", "solid_fields.csv",
                               "energies.csv"}},
                    Recording{"box",
                              "--duration 0.1 --set 'tracked.0.test_functions=[{name: foot, regions: {foot: {guide: "
                              "[0..3]}}}, {name: tight, basis: subdivision, from: 0.05}]'",
                              {"nodes.csv", "grasps.csv", "cloths.csv", "tracking.csv"}},
                    Recording{"tracked_rope", "--duration 0.1", {"nodes.csv", "grasps.csv", "tracking.csv"}}),
    [](const auto& info) { return std::string(info.param.scene); });

TEST_F(Exports, withoutTheScenesFilesTablesLackOnlyTheirAverages)
{
  const std::string bag = record("box", "--duration 0.1 --csv " + path("direct"));
  const Result result = shell("cd / && " + csv + " " + bag + " --out " + path("exported"));
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("tracking.csv is left out"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("box_guide.obj"), std::string::npos) << result.output;
  EXPECT_EQ(namesIn(path("exported")), (std::set<std::string>{"nodes.csv", "grasps.csv", "cloths.csv"}));
  // times from the stamps
  EXPECT_TRUE(contentsOf(path("direct/cloths.csv")) == contentsOf(path("exported/cloths.csv")));
}

TEST_F(Exports, objAndPlySequencesOfACloth)
{
  const std::string bag = record("handkerchief", "--duration 0.2");   // 11 instants, 0.02 s apart
  expectExported(mesh + " " + bag + " --quiet --out " + path("obj"));
  expectExported(mesh + " " + bag + " --quiet --format ply --fps 25 --out " + path("ply"));
  EXPECT_EQ(namesIn(path("obj")).size(), 11u);
  EXPECT_EQ(namesIn(path("ply")).size(), 6u);
  BagReader reader(bag);
  SceneSnapshot instant;
  for (int k = 0; reader.next(instant); ++k)
  {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%06d.obj", k);
    const TriangleMesh obj = readObj(path("obj/") + name);
    ASSERT_EQ(instant.cloths.size(), 1u);
    EXPECT_TRUE(obj.vertices == instant.cloths[0].x) << k;   // to the last digit
    EXPECT_TRUE(obj.triangles == instant.cloths[0].triangles);
    if (k % 2 == 0)
    {
      std::snprintf(name, sizeof name, "frame_%06d.ply", k / 2);
      EXPECT_TRUE(readPly(path("ply/") + name).vertices == obj.vertices);
    }
  }
  const std::string text = contentsOf(path("obj/frame_000010.obj"));
  EXPECT_NE(text.find("t = 0.2 s"), std::string::npos) << text.substr(0, 200);
}

TEST_F(Exports, rodsAreTubesAroundTheirNodes)
{
  const std::string bag = record("demo_rope", "--duration 0.02");
  expectExported(mesh + " " + bag + " --quiet --sides 8 --out " + path("obj"));
  BagReader reader(bag);
  SceneSnapshot instant;
  ASSERT_TRUE(reader.next(instant));
  const RodSnapshot& rod = instant.rods.at(0);
  const TriangleMesh tube = readObj(path("obj/frame_000000.obj"));
  for (Eigen::Index i = 0; i < rod.x.cols(); ++i)   // eight vertices at the radius around each node
  {
    int near = 0;
    for (Eigen::Index k = 0; k < tube.vertices.cols(); ++k)
      near += std::abs((tube.vertices.col(k) - rod.x.col(i)).norm() - rod.radius_a[0]) < 1e-9;
    EXPECT_GE(near, 8) << i;
  }
}

#ifdef SLENDER_WITH_GLTF
/// A moving file as a viewer sees it.
struct Glb
{
  tinygltf::Model model;

  explicit Glb(const std::string& path)
  {
    tinygltf::TinyGLTF loader;
    std::string error, warning;
    EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, path)) << error;
    EXPECT_EQ(error + warning, "");
  }

  Eigen::MatrixXf values(int accessor) const
  {
    const tinygltf::Accessor& a = model.accessors.at(accessor);
    const tinygltf::BufferView& view = model.bufferViews.at(a.bufferView);
    const int rows = a.type == TINYGLTF_TYPE_VEC3 ? 3 : 1;
    EXPECT_EQ(a.componentType, TINYGLTF_COMPONENT_TYPE_FLOAT);
    Eigen::MatrixXf out(rows, static_cast<Eigen::Index>(a.count));
    std::memcpy(out.data(), model.buffers[view.buffer].data.data() + view.byteOffset + a.byteOffset,
                out.size() * sizeof(float));
    return out;
  }

  /// Index of the key at or before a time.
  static Eigen::Index keyAt(const Eigen::MatrixXf& times, double seconds)
  {
    Eigen::Index key = 0;
    while (key + 1 < times.cols() && times(0, key + 1) <= seconds + 1e-6)
      ++key;
    return key;
  }

  /// Vertices of all nodes that are seen at the time of a frame, in the file's axes below its root.
  std::vector<Eigen::Matrix3Xf> seenAt(double seconds) const
  {
    std::vector<Eigen::Matrix3Xf> out;
    for (const int node : model.nodes.at(0).children)
    {
      const tinygltf::Primitive& primitive = model.meshes.at(model.nodes[node].mesh).primitives.at(0);
      Eigen::Matrix3Xf x = values(primitive.attributes.at("POSITION"));
      float scale = 1;
      if (!model.animations.empty())
        for (const tinygltf::AnimationChannel& channel : model.animations[0].channels)
        {
          if (channel.target_node != node)
            continue;
          const tinygltf::AnimationSampler& sampler = model.animations[0].samplers.at(channel.sampler);
          const Eigen::MatrixXf times = values(sampler.input), keys = values(sampler.output);
          const Eigen::Index key = keyAt(times, seconds), targets = static_cast<Eigen::Index>(primitive.targets.size());
          if (channel.target_path == "scale")
            scale = keys(0, key);
          else if (seconds >= times(0, 0) - 1e-6)
            for (Eigen::Index t = 0; t < targets; ++t)
              x += keys(0, key * targets + t) * values(primitive.targets[t].at("POSITION"));
        }
      if (scale > 0)
        out.push_back(x);
    }
    return out;
  }
};

TEST_F(Exports, glbShowsTheRecordedFrames)
{
  for (const auto& [scene, duration] : {std::pair("handkerchief", "0.2"), {"demo_rope", "0.2"}, {"honey_coil", "1.0"}})
  {
    const std::string bag = record(scene, std::string("--duration ") + duration),
                      file = path(scene + std::string(scene == std::string("demo_rope") ? ".GLB" : ".glb"));
    expectExported(mesh + " " + bag + " --quiet --fps 12.5 --scene-dir " + source + "/config/scenes --out " + file);
    const Glb glb(file);
    const std::vector<double>& turn = glb.model.nodes.at(0).rotation;   // our z to glTF's y
    EXPECT_LT((Eigen::Quaterniond(turn.at(3), turn[0], turn[1], turn[2]) * Eigen::Vector3d::UnitZ() -
               Eigen::Vector3d::UnitY())
                  .norm(),
              1e-12);
    BagReader reader(bag);
    SceneSnapshot instant;
    FrameChoice choice(12.5);
    int frames = 0;
    while (reader.next(instant))
    {
      if (!choice.takes(reader.seconds()))
        continue;
      ++frames;
      const std::vector<ObjectMesh> objects = objectMeshes(instant, nullptr, TubeResolution());
      const std::vector<Eigen::Matrix3Xf> seen = glb.seenAt(reader.seconds());
      ASSERT_EQ(seen.size(), objects.size()) << scene << " " << reader.seconds();
      for (std::size_t k = 0; k < seen.size(); ++k)
      {
        ASSERT_EQ(seen[k].cols(), objects[k].mesh.vertices.cols());
        EXPECT_LT((seen[k].cast<double>() - objects[k].mesh.vertices).cwiseAbs().maxCoeff(), 3e-7)
            << scene << " " << reader.seconds();
      }
    }
    EXPECT_GE(frames, 3);
  }
}
#endif

TEST_F(Exports, videosHaveTheirFramesAndSize)
{
  if (shell("command -v ffprobe").status != 0)
    GTEST_SKIP() << "no ffmpeg";
  const std::string bag = record("handkerchief", "--duration 0.2");
  expectExported(video + " " + bag + " --quiet --size 160x96 --out " + path("x.mp4"));
  expectExported(video + " " + bag + " --quiet --size 160x96 --speed 0.5 --out " + path("x.gif"));
  const std::string probe =
      "ffprobe -v error -count_frames -show_entries stream=codec_name,width,height,nb_read_frames -of csv=p=0 ";
  EXPECT_EQ(shell(probe + path("x.mp4")).output, "h264,160,96,6\n");   // 0, 0.04 ... 0.2 s
  EXPECT_EQ(shell(probe + path("x.gif")).output, "gif,160,96,6\n");
  for (const char* name : {"x.mp4", "x.gif"})
  {
    EXPECT_EQ(picturesIn(path(name)), 6) << name;
    const std::string whole = contentsOf(path(name));
    for (const std::size_t left :
         {whole.size() - 1, whole.size() / 2, whole.size() / 5, std::size_t{10}, std::size_t{0}})
    {
      std::ofstream(path("cut"), std::ios::binary | std::ios::trunc) << whole.substr(0, left);
      EXPECT_EQ(picturesIn(path("cut")), 0) << name << " cut to " << left << " bytes";
    }
  }
}

TEST(Picture, showsTheNearerSurfaceLitFromAboveAndItsShadow)
{
  const auto ball = [](const Eigen::Vector3d& at, double radius, ObjectKind kind) {
    ObjectMesh object{kind, "ball", 0, shapeMesh(Sphere{radius}), {}};
    object.mesh.vertices.colwise() += at;
    return object;
  };
  PictureView view;
  view.width = view.height = 200;
  view.from = {0, -1, 0.3};
  view.box.extend(Eigen::Vector3d(-1, -1, 0));
  view.box.extend(Eigen::Vector3d(1, 1, 2));
  view.ground = 0;
  PicturePainter painter(view);
  const auto pixel = [](const std::vector<std::uint8_t>& picture, int x, int y) {
    return Eigen::Vector3d(picture[3 * (200 * y + x)], picture[3 * (200 * y + x) + 1], picture[3 * (200 * y + x) + 2]);
  };
  const auto empty = painter.paint({});
  const auto behind =
      painter.paint({ball({0, 1, 0.7}, 0.5, ObjectKind::body), ball({0, 0, 1}, 0.5, ObjectKind::thread)});
  const auto turned =
      painter.paint({ball({0, 0, 1}, 0.5, ObjectKind::thread), ball({0, 1, 0.7}, 0.5, ObjectKind::body)});
  EXPECT_TRUE(behind == turned);                                                 // the order does not matter
  EXPECT_GT(pixel(behind, 100, 100).x(), 2 * pixel(behind, 100, 100).z());       // honey-coloured, not red
  EXPECT_GT(pixel(behind, 100, 80).sum(), pixel(behind, 100, 120).sum() + 60);   // brighter above
  EXPECT_TRUE(pixel(behind, 2, 2) == pixel(empty, 2, 2));
  int darker = 0;
  for (int y = 100; y < 200; ++y)
    for (int x = 0; x < 200; ++x)
      darker += pixel(behind, x, y).minCoeff() > 100 && pixel(behind, x, y).sum() < pixel(empty, x, y).sum() - 60;
  EXPECT_GT(darker, 100);   // grey: the shadow on the floor
}

TEST(Picture, allPointsAreSeenFromAsNearAsPossible)
{
  constexpr double kHalfHeight = 0.3 * 0.9, kHalfWidth = kHalfHeight * 16 / 9;   // slopes, with the margin of a tenth
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0.55, -1.0, 0.45), Eigen::Vector3d(0, 0, 2)})
    for (const Eigen::Vector3d& size : {Eigen::Vector3d(1, 0.1, 0.2), Eigen::Vector3d(0.05, 0.05, 3)})
    {
      EyeFinder finder(from, 1280, 720), balls(from, 1280, 720);
      // a tetrahedron, whose box has corners where nothing is
      Eigen::Matrix3Xd points(3, 4);
      points << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
      points = (size.asDiagonal() * points).colwise() + Eigen::Vector3d(5, -3, 2);
      finder.add(points.leftCols(2));
      finder.add(points.rightCols(2));
      balls.add(points, 0.1);
      const Eigen::Matrix3Xd seen = points.colwise() - finder.eye();
      const Eigen::ArrayXd depth = (finder.forward().transpose() * seen).transpose();
      const Eigen::ArrayXd across = (finder.right().transpose() * seen).transpose().array() / depth / kHalfWidth;
      const Eigen::ArrayXd along = (finder.up().transpose() * seen).transpose().array() / depth / kHalfHeight;
      EXPECT_GT(depth.minCoeff(), 0);
      EXPECT_LT(std::max(across.abs().maxCoeff(), along.abs().maxCoeff()), 1 + 1e-9);   // rounding
      // Points touch both of two opposite borders, or one is so near that the farthest is five times as far away.
      const double filled =
          std::max(std::min(across.maxCoeff(), -across.minCoeff()), std::min(along.maxCoeff(), -along.minCoeff()));
      const double nearness = depth.minCoeff() / (depth.maxCoeff() - depth.minCoeff());
      EXPECT_TRUE(std::abs(filled - 1) < 1e-9 || std::abs(nearness - 0.25) < 1e-4) << filled << " " << nearness;
      EXPECT_LT(finder.forward().dot(balls.eye()), finder.forward().dot(finder.eye()) - 0.1);
    }
}

TEST(FrameChoice, thinsToTheRateFromTheFirstOn)
{
  FrameChoice all(0), thin(10);
  int of_all = 0, of_thin = 0;
  for (int k = 0; k <= 100; ++k)   // 1 s
  {
    of_all += all.takes(0.01 * k);
    of_thin += thin.takes(0.01 * k + (k % 2 ? 4e-10 : -4e-10));
  }
  EXPECT_EQ(of_all, 101);
  EXPECT_EQ(of_thin, 11);
}

/// Where a holder is, and how far it extends.
Eigen::AlignedBox3d boxOf(const ObjectMesh& object)
{
  return {object.mesh.vertices.rowwise().minCoeff(), object.mesh.vertices.rowwise().maxCoeff()};
}

TEST(Holders, areShownInVideos)
{
  const Simulation rods(parseScene(R"(
rods: [{name: r, centerline: {straight: {to: [1, 0, 0], edges: 10}}, cross_section: {radius: 0.01}, grasps: {left: {edges: [0]}, pin: {nodes: [5], hold: position}}}]
)",
                                   "scene"));
  SceneSnapshot instant = snapshotOf(rods);
  std::vector<ObjectMesh> holders = holderMeshes(instant, &rods.config());
  ASSERT_EQ(holders.size(), 2u);
  EXPECT_NEAR((boxOf(holders[0]).sizes() - Eigen::Vector3d::Constant(0.036)).norm(), 0.0, 1e-9);
  EXPECT_EQ(holders[0].mesh.vertices.cols(), 8);   // a box at the clamped end
  EXPECT_LT(boxOf(holders[0]).center().norm(), 1e-9);
  EXPECT_GT(holders[1].mesh.vertices.cols(), 100);   // a ball at the pinned node
  EXPECT_LT((boxOf(holders[1]).center() - Eigen::Vector3d(0.5, 0, 0)).norm(), 1e-9);
  instant.grasps[0].held->active = false;
  EXPECT_EQ(holderMeshes(instant, &rods.config()).size(), 1u);

  const Simulation cloth(parseScene(R"(
cloths: [{name: c, grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 4}, grasps: {edge: {near: {point: [0, 0, 0], radius: 0.3}}}}]
)",
                                    "scene"));
  instant = snapshotOf(cloth);
  const std::size_t held = cloth.config().cloths[0].grasps[0].vertices.size();
  ASSERT_GT(held, 1u);
  EXPECT_EQ(holderMeshes(instant, &cloth.config()).size(), held);
  EXPECT_EQ(holderMeshes(instant, nullptr).size(), 1u);
  instant.grasps[0].held->X_WG.position.x() += 0.5;   // it holds other vertices by now
  holders = holderMeshes(instant, &cloth.config());
  ASSERT_EQ(holders.size(), 1u);
  EXPECT_LT((boxOf(holders[0]).center() - instant.grasps[0].held->X_WG.position).norm(), 1e-9);

  const Simulation thread(parseScene(
      "threads: [{name: t, nozzle: {position: [0, 0, 0.1], diameter: 0.01, flow: 1.0e-6}, floor: {height: 0}}]",
      "scene"));
  holders = holderMeshes(snapshotOf(thread), &thread.config());
  ASSERT_EQ(holders.size(), 1u);
  // The nozzle stands upright above its outlet, however the newest edge is tilted.
  EXPECT_NEAR(boxOf(holders[0]).min().z(), 0.1, 1e-6);
  EXPECT_NEAR(boxOf(holders[0]).max().z(), 0.14, 1e-6);

  const Simulation turning(
      parseScene("threads: [{name: t, nozzle: {diameter: 0.01, flow: 1.0e-6, motion: {table: [[0, 0, 0, 0.1, 0, "
                 "0.70710678118654752, 0, "
                 "0.70710678118654752], [1, 0, 0, 0.1, 0, 0, 0, 1]]}}, floor: {height: 0}}]",
                 "scene"));
  instant = snapshotOf(turning);
  holders = holderMeshes(instant, &turning.config());
  ASSERT_EQ(holders.size(), 1u);
  EXPECT_NEAR(boxOf(holders[0]).max().z(), 0.14, 1e-6);   // down at first
  instant.time = 1.0;
  holders = holderMeshes(instant, &turning.config());
  EXPECT_NEAR(boxOf(holders[0]).min().x(), -0.04, 1e-6);   // along x in the end
  EXPECT_NEAR(boxOf(holders[0]).max().x(), 0.0, 1e-6);
}

TEST(Holders, tiltedPlanesAreShownBesideTheGround)
{
  const Simulation scene(parseScene(R"(
rods: [{}]
obstacles: [{name: floor, shape: {plane: {}}}, {name: plate, shape: {plane: {point: [0, 0, 1], normal: [-1, 0, 1]}}}]
)",
                                    "scene"));
  const std::optional<double> ground = groundOf(&scene.config());
  ASSERT_TRUE(ground);
  EXPECT_EQ(*ground, 0.0);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));
  const auto planes = planeMeshes(snapshotOf(scene), scene.config(), box, ground);
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].name, "plate");
  for (Eigen::Index i = 0; i < planes[0].mesh.vertices.cols(); ++i)
    EXPECT_NEAR(planes[0].mesh.vertices(2, i) - planes[0].mesh.vertices(0, i), 1.0, 1e-12);   // z = 1 + x
}

}   // namespace
}   // namespace slender
