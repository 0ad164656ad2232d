#include "slender_sim/scene/recorder.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

namespace slender {

namespace {

void makeFolder(const std::string& folder)
{
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder))
  {
    throw std::runtime_error(folder + ": cannot be made a folder" + (error ? ": " + error.message() : ""));
  }
}

/// A text file written through a buffer; every failure is an exception.
class TextFile
{
public:
  explicit TextFile(std::string path) : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc)
  {
    if (!file_)
    {
      throw std::runtime_error(path_ + ": cannot be opened for writing: " + std::strerror(errno));
    }
  }

  TextFile& operator<<(const std::string& text)
  {
    line_ += text;
    return *this;
  }
  TextFile& operator<<(const char* text)
  {
    line_ += text;
    return *this;
  }
  TextFile& operator<<(char c)
  {
    line_ += c;
    return *this;
  }
  template <class Number>
  TextFile& number(Number value)
  {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
    line_.append(buffer, end.ptr);
    return *this;
  }
  TextFile& vector(const Eigen::Vector3d& v, char separator)
  {
    number(v.x()) << separator;
    number(v.y()) << separator;
    return number(v.z());
  }
  void endLine()
  {
    line_ += '\n';
    file_.write(line_.data(), static_cast<std::streamsize>(line_.size()));
    line_.clear();
    check();
  }
  void close()
  {
    file_.close();
    check();
  }

private:
  void check()
  {
    if (!file_)
    {
      throw std::runtime_error(path_ + ": writing failed: " + std::strerror(errno));
    }
  }

  std::string path_;
  std::ofstream file_;
  std::string line_;
};

class CsvRecorder final : public Recorder
{
public:
  explicit CsvRecorder(const std::string& folder)
    : folder_(folder), nodes_((makeFolder(folder), folder + "/nodes.csv")), grasps_(folder + "/grasps.csv")
  {
    nodes_ << "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],d1x,d1y,d1z,twist [rad]";
    nodes_.endLine();
    grasps_ << "t [s],object,grasp,active,x [m],y [m],z [m],qx,qy,qz,qw,fx [N],fy [N],fz [N],tx [N m],ty [N m],tz [N m]";
    grasps_.endLine();
  }

  void record(const Simulation& simulation, const StepReport&) override
  {
    const SceneState& state = simulation.state();
    for (std::size_t r = 0; r < state.rods.size(); ++r)
    {
      recordRod(state.time, simulation.rodModel(static_cast<int>(r)), state.rods[r]);
    }
    for (std::size_t k = 0; k < state.threads.size(); ++k)
    {
      for (const ThreadState& thread : state.threads[k].threads)
      {
        recordThread(state.time, simulation.threadModel(static_cast<int>(k)).name, thread);
      }
    }
    for (std::size_t k = 0; k < state.cloths.size(); ++k)
    {
      recordCloth(state.time, simulation.clothModel(static_cast<int>(k)).name, state.cloths[k].cloth);
      if (simulation.config().cloths[k].tracking)
      {
        recordTracking(state.time, simulation.config().cloths[k], state.cloths[k]);
      }
    }
    for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
    {
      const GraspRef& ref = simulation.grasps()[g];
      const int grasp = static_cast<int>(g);
      const Pose& X_WG = simulation.graspPose(grasp);
      const Wrench& wrench = simulation.wrench(grasp);
      grasps_.number(state.time) << ',' << simulation.heldObject(grasp) << ',' << ref.config->name << ',';
      grasps_ << (simulation.isActive(grasp) ? "1," : "0,");
      const Eigen::Vector4d q = X_WG.orientation.coeffs();
      grasps_.vector(X_WG.position, ',') << ',';
      grasps_.vector(q.head<3>(), ',') << ',';
      grasps_.number(q[3]) << ',';
      grasps_.vector(wrench.force, ',') << ',';
      grasps_.vector(wrench.torque, ',');
      grasps_.endLine();
    }
    const SceneConfig& scene = simulation.config();
    for (std::size_t b = 0; b < state.bodies.size(); ++b)
    {
      recordSolid(state.time, scene.bodies[b].name, state.bodies[b].X_WB, state.bodies[b].velocity);
    }
    for (std::size_t k = 0; k < state.obstacles.size(); ++k)
    {
      recordSolid(state.time, scene.obstacles[k].name, state.obstacles[k], state.obstacle_velocities[k]);
    }
  }

  void finish() override
  {
    nodes_.close();
    grasps_.close();
    for (auto* file : {&bodies_, &threads_, &cloths_, &tracking_})
    {
      if (*file)
      {
        (*file)->close();
      }
    }
  }

private:
  void recordRod(double time, const RodModel& model, const RodState& rod)
  {
    for (int i = 0; i < model.nodes(); ++i)
    {
      nodes_.number(time) << ',' << model.name << ',';
      nodes_.number(i) << ',';
      nodes_.vector(rod.x.col(i), ',') << ',';
      nodes_.vector(rod.v.col(i), ',') << ',';
      nodes_.vector(rod.d1.col(std::min(i, model.edges() - 1)), ',') << ',';
      nodes_.number(rod.twist[i]);
      nodes_.endLine();
    }
  }

  void recordThread(double time, const std::string& name, const ThreadState& thread)
  {
    if (!threads_)
    {
      threads_.emplace(folder_ + "/threads.csv");
      *threads_ << "t [s],object,thread,id,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],radius [m],deposited";
      threads_->endLine();
    }
    for (int i = 0; i < thread.nodes(); ++i)
    {
      threads_->number(time) << ',' << name << ',';
      threads_->number(thread.thread_id) << ',';
      threads_->number(thread.id[i]) << ',';
      threads_->vector(thread.x[i], ',') << ',';
      threads_->vector(thread.v[i], ',') << ',';
      threads_->number(thread.radius(std::min(i, thread.edges() - 1))) << (thread.deposited[i] ? ",1" : ",0");
      threads_->endLine();
    }
  }

  void recordCloth(double time, const std::string& name, const ClothState& cloth)
  {
    if (!cloths_)
    {
      cloths_.emplace(folder_ + "/cloths.csv");
      *cloths_ << "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]";
      cloths_->endLine();
    }
    for (Eigen::Index i = 0; i < cloth.x.cols(); ++i)
    {
      cloths_->number(time) << ',' << name << ',';
      cloths_->number(i) << ',';
      cloths_->vector(cloth.x.col(i), ',') << ',';
      cloths_->vector(cloth.v.col(i), ',');
      cloths_->endLine();
    }
  }

  void recordTracking(double time, const ClothConfig& cloth, const SceneCloth& state)
  {
    if (!tracking_)
    {
      tracking_.emplace(folder_ + "/tracking.csv");
      *tracking_ << "t [s],object,function,x [m],y [m],z [m],fx [N],fy [N],fz [N]";
      tracking_->endLine();
    }
    const WeakConstraints& constraints = *cloth.tracking->constraints;
    const Eigen::Matrix3Xd averages = constraints.averages(state.guide);
    for (int i = 0; i < constraints.count(); ++i)
    {
      tracking_->number(time) << ',' << cloth.name << ',' << constraints.name(i) << ',';
      tracking_->vector(averages.col(i), ',') << ',';
      tracking_->vector(state.guide_forces.col(i), ',');
      tracking_->endLine();
    }
  }

  void recordSolid(double time, const std::string& name, const Pose& pose, const Twist& velocity)
  {
    if (!bodies_)
    {
      bodies_.emplace(folder_ + "/bodies.csv");
      *bodies_ << "t [s],object,x [m],y [m],z [m],qx,qy,qz,qw,vx [m/s],vy [m/s],vz [m/s],wx [rad/s],wy [rad/s],wz [rad/s]";
      bodies_->endLine();
    }
    const Eigen::Vector4d q = pose.orientation.coeffs();
    bodies_->number(time) << ',' << name << ',';
    bodies_->vector(pose.position, ',') << ',';
    bodies_->vector(q.head<3>(), ',') << ',';
    bodies_->number(q[3]) << ',';
    bodies_->vector(velocity.linear, ',') << ',';
    bodies_->vector(velocity.angular, ',');
    bodies_->endLine();
  }

  std::string folder_;
  TextFile nodes_, grasps_;
  std::optional<TextFile> bodies_, threads_, cloths_, tracking_;   // only scenes that have any
};

class ObjRecorder final : public Recorder
{
public:
  explicit ObjRecorder(std::string folder) : folder_(std::move(folder)) { makeFolder(folder_); }

  void record(const Simulation& simulation, const StepReport&) override
  {
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%06ld.obj", frame_++);
    TextFile file(folder_ + name);
    file << "# scene " << oneLine(simulation.config().name) << ", t = ";
    file.number(simulation.state().time) << " s; lengths in m";
    file.endLine();
    int first = 1;   // OBJ counts from 1, over the whole file
    for (std::size_t r = 0; r < simulation.state().rods.size(); ++r)
    {
      const RodModel& model = simulation.rodModel(static_cast<int>(r));
      const Eigen::Matrix3Xd& x = simulation.state().rods[r].x;
      file << "o " << model.name;
      file.endLine();
      for (int i = 0; i < model.nodes(); ++i)
      {
        file << "v ";
        file.vector(x.col(i), ' ');
        file.endLine();
      }
      file << 'l';
      for (int i = 0; i <= model.edges(); ++i)
      {
        file << ' ';
        file.number(first + i % model.nodes());
      }
      file.endLine();
      first += model.nodes();
    }
    for (std::size_t k = 0; k < simulation.state().threads.size(); ++k)
    {
      for (const ThreadState& thread : simulation.state().threads[k].threads)
      {
        file << "o " << simulation.threadModel(static_cast<int>(k)).name;
        file.endLine();
        for (const Eigen::Vector3d& x : thread.x)
        {
          file << "v ";
          file.vector(x, ' ');
          file.endLine();
        }
        file << 'l';
        for (int i = 0; i < thread.nodes(); ++i)
        {
          file << ' ';
          file.number(first + i);
        }
        file.endLine();
        first += thread.nodes();
      }
    }
    for (std::size_t k = 0; k < simulation.state().cloths.size(); ++k)
    {
      const ClothModel& model = simulation.clothModel(static_cast<int>(k));
      file << "o " << model.name;
      file.endLine();
      const Eigen::Matrix3Xd& x = simulation.state().cloths[k].cloth.x;
      for (int i = 0; i < model.vertices(); ++i)
      {
        file << "v ";
        file.vector(x.col(i), ' ');
        file.endLine();
      }
      for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
      {
        file << 'f';
        for (int corner = 0; corner < 3; ++corner)
        {
          file << ' ';
          file.number(first + model.rest.triangles(corner, f));
        }
        file.endLine();
      }
      first += model.vertices();
    }
    file.close();
  }

  void finish() override {}

private:
  static std::string oneLine(std::string text)
  {
    for (char& c : text)
    {
      c = c == '\n' || c == '\r' ? ' ' : c;
    }
    return text;
  }

  std::string folder_;
  long frame_ = 0;
};

}  // namespace

std::unique_ptr<Recorder> makeCsvRecorder(const std::string& folder) { return std::make_unique<CsvRecorder>(folder); }

std::unique_ptr<Recorder> makeObjRecorder(const std::string& folder) { return std::make_unique<ObjRecorder>(folder); }

}  // namespace slender
