#include "slender_sim/scene/csv_tables.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

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
  std::map<std::string, TextFile> tables;   ///< by name

  explicit Files(const std::string& to) : folder(clearedFolder(to)) {}

  /// The table of this name. It begins with the header.
  TextFile& opened(const std::string& name, const std::string& header)
  {
    auto table = tables.find(name);
    if (table == tables.end())
    {
      table = tables.emplace(name, TextFile(folder + "/" + name + ".csv")).first;
      table->second.row(header);
    }
    return table->second;
  }

  TextFile& nodes()
  {
    return opened("nodes", "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],d1x,d1y,d1z,twist [rad]");
  }
  TextFile& grasps()
  {
    return opened(
        "grasps",
        "t [s],object,grasp,active,x [m],y [m],z [m],qx,qy,qz,qw,fx [N],fy [N],fz [N],tx [N m],ty [N m],tz [N m]");
  }
};

namespace {

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
    // of the frame as it is published, so that tables made from bags are the same to the last digit
    const Eigen::Vector3d d1 = rod.frames[std::min(i, edges - 1)] * Eigen::Vector3d::UnitY();
    file.row(time, rod.name, i, rod.x.col(i), rod.v.col(i), d1, rod.twist[i]);
  });
}

void writeThread(TextFile& file, double time, const ThreadSnapshot& thread)
{
  for (Eigen::Index i = 0; i < thread.x.cols(); ++i)
    file.row(time, thread.name, thread.thread_id, thread.ids[i], thread.x.col(i), thread.v.col(i),
             thread.radius[std::min(i, thread.radius.size() - 1)], thread.deposited[i] ? 1 : 0);
}

void writeCloth(TextFile& file, double time, const ClothSnapshot& cloth, const NodeChoice& nodes)
{
  eachChosen(nodes, cloth.name, cloth.x.cols(),
             [&](Eigen::Index i) { file.row(time, cloth.name, i, cloth.x.col(i), cloth.v.col(i)); });
}

void writeGrasp(TextFile& file, double time, const GraspSnapshot& grasp)
{
  const auto& [force, torque] = grasp.wrench;
  if (grasp.held)
    file.row(time, grasp.held->object, grasp.name, grasp.held->active ? 1 : 0, grasp.held->X_WG, force, torque);
  else
    file.row(time, "", grasp.name, "", "", "", "", "", "", "", "", force, torque);
}

/// Tables of threads, and of whole objects (energies), have all their rows.
bool isOfNodes(const FieldTable& table) { return table.table == "rod_fields" || table.table == "cloth_fields"; }

void writeFields(TextFile& file, double time, const FieldTable& table, const NodeChoice& nodes)
{
  const bool indexed = table.values.rows() > 1;
  eachChosen(isOfNodes(table) ? nodes : NodeChoice(), table.object, table.values.rows(), [&](Eigen::Index i) {
    file.cell(time);
    file.cell(table.object);
    if (indexed)
      file.cell(i);
    for (const double value : table.values.row(i))
      if (std::isnan(value))
        file.cell("");
      else
        file.cell(value);
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
  files_->nodes();   // these two are there also where the scene has no rods and no grasps
  files_->grasps();
}

CsvTables::~CsvTables() = default;

void CsvTables::write(const SceneSnapshot& instant, const NodeChoice& nodes)
{
  const double time = instant.time;
  for (const RodSnapshot& rod : instant.rods)
    writeRod(files_->nodes(), time, rod, nodes);
  for (const ThreadSnapshot& thread : instant.threads)
    writeThread(
        files_->opened("threads",
                       "t [s],object,thread,id,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],radius [m],deposited"),
        time, thread);
  for (const ClothSnapshot& cloth : instant.cloths)
    writeCloth(files_->opened("cloths", "t [s],object,index,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"), time, cloth,
               nodes);
  for (const FunctionSnapshot& function : instant.functions)
    files_->opened("tracking", "t [s],object,function,x [m],y [m],z [m],fx [N],fy [N],fz [N]")
        .row(time, function.object, function.name, function.average, function.force);
  for (const GraspSnapshot& grasp : instant.grasps)
    writeGrasp(files_->grasps(), time, grasp);
  for (const auto* solids : {&instant.bodies, &instant.obstacles})
    for (const SolidSnapshot& solid : *solids)
      files_
          ->opened(
              "bodies",
              "t [s],object,x [m],y [m],z [m],qx,qy,qz,qw,vx [m/s],vy [m/s],vz [m/s],wx [rad/s],wy [rad/s],wz [rad/s]")
          .row(time, solid.name, solid.pose, solid.velocity.linear, solid.velocity.angular);
  for (const FieldTable& table : instant.fields)
    writeFields(files_->opened(table.table, headerOf(table)), time, table, nodes);
}

void CsvTables::finish()
{
  for (auto& [name, table] : files_->tables)
    table.close();
}

}   // namespace slender
