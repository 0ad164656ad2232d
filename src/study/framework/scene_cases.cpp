#include "scene_cases.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <stdlib.h>

#include "package_scenes.h"
#include "slender_sim/scene/reader.h"

namespace slender::study {

namespace {

/// The files that scenes refer to, where these expect them, for as long as this lives.
class PackageFolder
{
public:
  PackageFolder() : path_((std::filesystem::temp_directory_path() / "slender_sim_XXXXXX").string())
  {
    if (!mkdtemp(path_.data()))
      throw std::runtime_error(path_ + ": cannot be made");
    for (const auto& [path, text] : packageFiles())
    {
      const std::filesystem::path file = path_ + "/" + path;
      std::filesystem::create_directories(file.parent_path());
      std::ofstream(file) << text;
    }
  }
  ~PackageFolder()
  {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PackageFolder(const PackageFolder&) = delete;
  PackageFolder& operator=(const PackageFolder&) = delete;
  const std::string& path() const { return path_; }
  std::string scenes() const { return path_ + "/scenes"; }

private:
  std::string path_;
};

}   // namespace

SceneConfig packageSceneConfig(const std::string& name, const std::vector<std::string>& overrides)
{
  const char* const text = packageFiles().at("scenes/" + name + ".yaml");
  const PackageFolder folder;
  return parseScene(text, name + ".yaml", overrides, folder.scenes());
}

Simulation packageScene(const std::string& name, const std::vector<std::string>& overrides)
{
  return Simulation(packageSceneConfig(name, overrides));
}

std::vector<BodyTrajectory> packageMotion(const std::string& name)
{
  return readPoseFile(PackageFolder().path() + "/motion/" + name + ".csv");
}

GroupSetup groupOf(const Simulation& scene)
{
  GroupSetup g;
  const SceneConfig& config = scene.config();
  for (std::size_t r = 0; r < config.rods.size(); ++r)
  {
    RodSetup rod;
    rod.model = std::make_shared<const RodModel>(scene.rodModel(static_cast<int>(r)));
    rod.state = scene.state().rods[r];
    rod.inputs.wind = config.wind;
    for (const GraspState& grasp : rod.state.grasps)
      rod.inputs.grasps.push_back({grasp.X_WG, std::nullopt});
    const int index = g.add(rod);
    if (const auto& contact = config.rods[r].contact)
      g.model.rods[index].contact = *contact;
  }
  for (std::size_t k = 0; k < config.obstacles.size(); ++k)
    addObstacle(g, config.obstacles[k].shape, scene.state().obstacles[k], config.obstacles[k].friction);
  g.model.contact.gap = config.contact.gap;
  g.model.contact.slip_speed = config.contact.slip_speed;
  g.setGravity(config.gravity);
  return g;
}

void draw(Plot& picture, const std::string& label, const Eigen::Matrix3Xd& nodes, bool closed, const Camera& camera,
          const Eigen::Vector3d& shift)
{
  const Eigen::Vector3d up =
      (camera.up - camera.up.dot(camera.view) * camera.view / camera.view.squaredNorm()).normalized();
  const Eigen::Vector3d right = camera.view.cross(up).normalized();
  Series& series = picture.at(label);
  if (!series.x.empty())
  {
    series.x.push_back(std::numeric_limits<double>::quiet_NaN());   // lifts the pen
    series.y.push_back(std::numeric_limits<double>::quiet_NaN());
  }
  const Eigen::Index count = nodes.cols();
  for (Eigen::Index i = 0; i < count + (closed ? 1 : 0); ++i)
  {
    const Eigen::Vector3d at = nodes.col(i % count) + shift;
    series.x.push_back(right.dot(at));
    series.y.push_back(up.dot(at));
  }
}

Plot& addPicture(StudyContext& context, const std::string& name, const std::string& title, const std::string& x_label,
                 const std::string& y_label)
{
  Plot& picture = context.plot(name, title, x_label, y_label);
  picture.log_x = picture.log_y = picture.markers = false;
  picture.equal_axes = true;
  return picture;
}

}   // namespace slender::study
