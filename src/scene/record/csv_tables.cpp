#include "slender_sim/scene/csv_tables.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "earlier_run.h"
#include "slender_sim/scene/statics_run.h"
#include "text_file.h"

namespace slender {

namespace {

/// Makes the folder, or removes the tables of an earlier run from it: of two runs with other objects the tables would
/// be mixed.
const std::string& clearedFolder(const std::string& folder)
{
  const auto ours = [](const std::string& name) {
    static const std::set<std::string> names = {
        "nodes.csv",      "grasps.csv",        "bodies.csv",       "threads.csv",      "cloths.csv",  "tracking.csv",
        "rod_fields.csv", "thread_fields.csv", "cloth_fields.csv", "solid_fields.csv", "energies.csv"};
    return names.count(name) > 0;
  };
  makeFolder(folder);
  clearEarlierRun(folder, ours, "t [s],");
  clearStatics(folder);
  return folder;
}

}   // namespace

struct CsvTables::Files
{
  std::string folder;
  TextFile nodes, grasps;
  std::optional<TextFile> bodies, threads, cloths, tracking;   // only scenes that have any
  std::map<std::string, TextFile> fields;                      // by name of the table

  explicit Files(const std::string& to)
    : folder(clearedFolder(to)),
      nodes(to + "/nodes.csv"),
      grasps(to + "/grasps.csv")
  {
  }

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

/// Calls row(index) for the chosen ones of `count` nodes of an object.
template <class Row>
void eachChosen(const NodeChoice& nodes, const std::string& object, Eigen::Index count, const Row& row)
{
  const auto chosen = nodes.find(object);
  if (chosen != nodes.end())
    for (const int index : chosen->second)
      row(static_cast<Eigen::Index>(index));
  else
    for (Eigen::Index index = 0; index < count; ++index)
      row(index);
}

void writeRod(TextFile& file, double time, const RodSnapshot& rod, const NodeChoice& nodes)
{
  const Eigen::Index edges = static_cast<Eigen::Index>(rod.frames.size());
  eachChosen(nodes, rod.name, rod.x.cols(), [&](Eigen::Index i) {
    file.number(time) << ',' << rod.name << ',';
    file.number(i) << ',';
    file.vector(rod.x.col(i), ',') << ',';
    file.vector(rod.v.col(i), ',') << ',';
    // of the frame as it is published, so that tables made from bags are the same to the last digit
    file.vector(rod.frames[std::min(i, edges - 1)] * Eigen::Vector3d::UnitY(), ',') << ',';
    file.number(rod.twist[i]);
    file.endLine();
  });
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

void writeCloth(TextFile& file, double time, const ClothSnapshot& cloth, const NodeChoice& nodes)
{
  eachChosen(nodes, cloth.name, cloth.x.cols(), [&](Eigen::Index i) {
    file.number(time) << ',' << cloth.name << ',';
    file.number(i) << ',';
    file.vector(cloth.x.col(i), ',') << ',';
    file.vector(cloth.v.col(i), ',');
    file.endLine();
  });
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

/// Tables of threads, and of whole objects (energies), have all their rows.
bool isOfNodes(const FieldTable& table) { return table.table == "rod_fields" || table.table == "cloth_fields"; }

void writeFields(TextFile& file, double time, const FieldTable& table, const NodeChoice& nodes)
{
  const bool indexed = table.values.rows() > 1;
  eachChosen(isOfNodes(table) ? nodes : NodeChoice(), table.object, table.values.rows(), [&](Eigen::Index i) {
    file.number(time) << ',' << table.object;
    if (indexed)
    {
      file << ',';
      file.number(i);
    }
    for (Eigen::Index k = 0; k < table.values.cols(); ++k)
    {
      file << ',';
      if (!std::isnan(table.values(i, k)))
        file.number(table.values(i, k));
    }
    file.endLine();
  });
}

std::string headerOf(const FieldTable& table)
{
  std::string header = table.values.rows() > 1 ? "t [s],object,index" : "t [s],object";
  for (const std::string& column : table.columns)
    header += "," + column;
  return header;
}

}   // namespace

CsvTables::CsvTables(const std::string& folder) : files_(std::make_unique<Files>(folder))
{
  files_->nodes << "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],d1x,d1y,d1z,twist [rad]";
  files_->nodes.endLine();
  files_->grasps
      << "t [s],object,grasp,active,x [m],y [m],z [m],qx,qy,qz,qw,fx [N],fy [N],fz [N],tx [N m],ty [N m],tz [N m]";
  files_->grasps.endLine();
}

CsvTables::~CsvTables() = default;

void CsvTables::write(const SceneSnapshot& instant, const NodeChoice& nodes)
{
  const double time = instant.time;
  for (const RodSnapshot& rod : instant.rods)
    writeRod(files_->nodes, time, rod, nodes);
  for (const ThreadSnapshot& thread : instant.threads)
    writeThread(
        files_->opened(files_->threads, "/threads.csv",
                       "t [s],object,thread,id,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],radius [m],deposited"),
        time, thread);
  for (const ClothSnapshot& cloth : instant.cloths)
    writeCloth(files_->opened(files_->cloths, "/cloths.csv",
                              "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"),
               time, cloth, nodes);
  for (const FunctionSnapshot& function : instant.functions)
  {
    TextFile& file = files_->opened(files_->tracking, "/tracking.csv",
                                    "t [s],object,function,x [m],y [m],z [m],fx [N],fy [N],fz [N]");
    file.number(time) << ',' << function.object << ',' << function.name << ',';
    file.vector(function.average, ',') << ',';
    file.vector(function.force, ',');
    file.endLine();
  }
  for (const GraspSnapshot& grasp : instant.grasps)
    writeGrasp(files_->grasps, time, grasp);
  for (const auto* solids : {&instant.bodies, &instant.obstacles})
    for (const SolidSnapshot& solid : *solids)
      writeSolid(
          files_->opened(
              files_->bodies, "/bodies.csv",
              "t [s],object,x [m],y [m],z [m],qx,qy,qz,qw,vx [m/s],vy [m/s],vz [m/s],wx [rad/s],wy [rad/s],wz [rad/s]"),
          time, solid);
  for (const FieldTable& table : instant.fields)
  {
    auto place = files_->fields.find(table.table);
    if (place == files_->fields.end())
    {
      place = files_->fields.emplace(table.table, TextFile(files_->folder + "/" + table.table + ".csv")).first;
      place->second << headerOf(table);
      place->second.endLine();
    }
    writeFields(place->second, time, table, nodes);
  }
}

void CsvTables::finish()
{
  files_->nodes.close();
  files_->grasps.close();
  for (auto* file : {&files_->bodies, &files_->threads, &files_->cloths, &files_->tracking})
    if (*file)
      (*file)->close();
  for (auto& [name, file] : files_->fields)
    file.close();
}

}   // namespace slender
