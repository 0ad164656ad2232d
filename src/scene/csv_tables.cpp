#include "slender_sim/scene/csv_tables.h"

#include <algorithm>
#include <optional>

#include "text_file.h"

namespace slender {

struct CsvTables::Files
{
  std::string folder;
  TextFile nodes, grasps;
  std::optional<TextFile> bodies, threads, cloths, tracking;   // only scenes that have any

  explicit Files(const std::string& to) : folder(to), nodes((makeFolder(to), to + "/nodes.csv")), grasps(to + "/grasps.csv") {}

  TextFile& opened(std::optional<TextFile>& file, const char* name, const char* header)
  {
    if (!file)
    {
      file.emplace(folder + name);
      *file << header;
      file->endLine();
    }
    return *file;
  }
};

namespace {

void put(TextFile& file, const Pose& pose)
{
  const Eigen::Vector4d q = pose.orientation.coeffs();
  file.vector(pose.position, ',') << ',';
  file.vector(q.head<3>(), ',') << ',';
  file.number(q[3]);
}

void writeRod(TextFile& file, double time, const RodSnapshot& rod)
{
  const Eigen::Index edges = static_cast<Eigen::Index>(rod.frames.size());
  for (Eigen::Index i = 0; i < rod.x.cols(); ++i)
  {
    file.number(time) << ',' << rod.name << ',';
    file.number(i) << ',';
    file.vector(rod.x.col(i), ',') << ',';
    file.vector(rod.v.col(i), ',') << ',';
    // of the frame as it is published, so that tables made from bags are the same to the last digit
    file.vector(rod.frames[std::min(i, edges - 1)] * Eigen::Vector3d::UnitY(), ',') << ',';
    file.number(rod.twist[i]);
    file.endLine();
  }
}

void writeThread(TextFile& file, double time, const ThreadSnapshot& thread)
{
  for (Eigen::Index i = 0; i < thread.x.cols(); ++i)
  {
    file.number(time) << ',' << thread.name << ',';
    file.number(thread.thread_id) << ',';
    file.number(thread.ids[i]) << ',';
    file.vector(thread.x.col(i), ',') << ',';
    file.vector(thread.v.col(i), ',') << ',';
    file.number(thread.radius[std::min(i, thread.radius.size() - 1)]) << (thread.deposited[i] ? ",1" : ",0");
    file.endLine();
  }
}

void writeCloth(TextFile& file, double time, const ClothSnapshot& cloth)
{
  for (Eigen::Index i = 0; i < cloth.x.cols(); ++i)
  {
    file.number(time) << ',' << cloth.name << ',';
    file.number(i) << ',';
    file.vector(cloth.x.col(i), ',') << ',';
    file.vector(cloth.v.col(i), ',');
    file.endLine();
  }
}

void writeGrasp(TextFile& file, double time, const GraspSnapshot& grasp)
{
  file.number(time) << ',' << (grasp.held ? grasp.held->object : std::string()) << ',' << grasp.name << ',';
  if (grasp.held)
  {
    file << (grasp.held->active ? "1," : "0,");
    put(file, grasp.held->X_WG);
  }
  else
    file << ",,,,,,,";
  file << ',';
  file.vector(grasp.wrench.force, ',') << ',';
  file.vector(grasp.wrench.torque, ',');
  file.endLine();
}

void writeSolid(TextFile& file, double time, const SolidSnapshot& solid)
{
  file.number(time) << ',' << solid.name << ',';
  put(file, solid.pose);
  file << ',';
  file.vector(solid.velocity.linear, ',') << ',';
  file.vector(solid.velocity.angular, ',');
  file.endLine();
}

}  // namespace

CsvTables::CsvTables(const std::string& folder) : files_(std::make_unique<Files>(folder))
{
  files_->nodes << "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],d1x,d1y,d1z,twist [rad]";
  files_->nodes.endLine();
  files_->grasps << "t [s],object,grasp,active,x [m],y [m],z [m],qx,qy,qz,qw,fx [N],fy [N],fz [N],tx [N m],ty [N m],tz [N m]";
  files_->grasps.endLine();
}

CsvTables::~CsvTables() = default;

void CsvTables::write(const SceneSnapshot& instant)
{
  const double time = instant.time;
  for (const RodSnapshot& rod : instant.rods)
    writeRod(files_->nodes, time, rod);
  for (const ThreadSnapshot& thread : instant.threads)
    writeThread(files_->opened(files_->threads, "/threads.csv",
                               "t [s],object,thread,id,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],radius [m],deposited"),
                time, thread);
  for (const ClothSnapshot& cloth : instant.cloths)
    writeCloth(files_->opened(files_->cloths, "/cloths.csv", "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"), time, cloth);
  for (const FunctionSnapshot& function : instant.functions)
  {
    TextFile& file = files_->opened(files_->tracking, "/tracking.csv", "t [s],object,function,x [m],y [m],z [m],fx [N],fy [N],fz [N]");
    file.number(time) << ',' << function.object << ',' << function.name << ',';
    file.vector(function.average, ',') << ',';
    file.vector(function.force, ',');
    file.endLine();
  }
  for (const GraspSnapshot& grasp : instant.grasps)
    writeGrasp(files_->grasps, time, grasp);
  for (const auto* solids : {&instant.bodies, &instant.obstacles})
    for (const SolidSnapshot& solid : *solids)
      writeSolid(files_->opened(files_->bodies, "/bodies.csv",
                                "t [s],object,x [m],y [m],z [m],qx,qy,qz,qw,vx [m/s],vy [m/s],vz [m/s],wx [rad/s],wy [rad/s],wz [rad/s]"),
                 time, solid);
}

void CsvTables::finish()
{
  files_->nodes.close();
  files_->grasps.close();
  for (auto* file : {&files_->bodies, &files_->threads, &files_->cloths, &files_->tracking})
    if (*file)
      (*file)->close();
}

}  // namespace slender
