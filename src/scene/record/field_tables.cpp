#include "slender_sim/scene/field_tables.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/rod/rod_sections.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

namespace {

constexpr double empty_cell = std::numeric_limits<double>::quiet_NaN();

/// Puts columns side by side.
class Columns
{
public:
  Columns(std::string table, const std::string& object, Eigen::Index rows)
    : table_{std::move(table), object, {}, Eigen::MatrixXd(rows, 0)}
  {
  }

  /// `values` has one row per name and one column per row of the table. Edges of an open rod are one fewer than its
  /// nodes: then the last column is written twice.
  void add(const std::vector<std::string>& names, const Eigen::MatrixXd& values)
  {
    const Eigen::Index before = table_.values.cols(), rows = table_.values.rows();
    table_.values.conservativeResize(Eigen::NoChange, before + values.rows());
    for (Eigen::Index i = 0; i < rows; ++i)
      table_.values.row(i).tail(values.rows()) = values.col(std::min(i, values.cols() - 1)).transpose();
    table_.columns.insert(table_.columns.end(), names.begin(), names.end());
  }
  void moveTo(std::vector<FieldTable>& out)
  {
    if (!table_.columns.empty() && table_.values.rows() > 0)
      out.push_back(std::move(table_));
  }

private:
  FieldTable table_;
};

bool asks(const std::vector<RecordField>& fields, RecordField field)
{
  return std::find(fields.begin(), fields.end(), field) != fields.end();
}

const std::vector<std::string> contact_columns = {"contact_fx [N]", "contact_fy [N]", "contact_fz [N]"};

void addRod(const Simulation& simulation, int rod, const std::vector<RecordField>& fields, std::vector<FieldTable>& out)
{
  const RodModel& model = simulation.rodModel(rod);
  Columns columns("rod_fields", model.name, model.nodes());
  const bool of_sections =
      std::any_of(fields.begin(), fields.end(), [](RecordField f) { return f < RecordField::energy; });
  const RodSections sections =
      of_sections ? sectionsOf(model, simulation.state().rods[static_cast<std::size_t>(rod)]) : RodSections();
  if (asks(fields, RecordField::curvature))
    columns.add({"kappa1 [1/m]", "kappa2 [1/m]"}, sections.curvature);
  if (asks(fields, RecordField::twist))
    columns.add({"twist_rate [rad/m]"}, sections.twist.transpose());
  if (asks(fields, RecordField::strain))
    columns.add({"strain"}, sections.strain.transpose());
  if (asks(fields, RecordField::force))
  {
    columns.add({"tension [N]"}, sections.tension.transpose());
    columns.add({"fx [N]", "fy [N]", "fz [N]"}, sections.force);
  }
  if (asks(fields, RecordField::moment))
  {
    columns.add({"moment_t [N m]", "moment_d1 [N m]", "moment_d2 [N m]"}, sections.material_moment);
    columns.add({"mx [N m]", "my [N m]", "mz [N m]"}, sections.moment);
  }
  if (asks(fields, RecordField::contact_force))
    columns.add(contact_columns, simulation.world().contactForces({ObjectRef::rod, rod}));
  columns.moveTo(out);
}

void addCloth(const Simulation& simulation, int cloth, const std::vector<RecordField>& fields,
              std::vector<FieldTable>& out)
{
  if (!asks(fields, RecordField::contact_force))
    return;
  const ClothModel& model = simulation.clothModel(cloth);
  Columns columns("cloth_fields", model.name, model.vertices());
  columns.add(contact_columns, simulation.world().contactForces({ObjectRef::cloth, cloth}));
  columns.moveTo(out);
}

/// Forces on obstacles and bodies, and torques about the origins of their poses. The impulses of cloth are not known.
void addSolids(const Simulation& simulation, std::vector<FieldTable>& out)
{
  const SceneConfig& scene = simulation.config();
  const SceneState& state = simulation.state();
  const ContactLoads loads = simulation.world().contactLoads();
  const bool known = std::none_of(scene.cloths.begin(), scene.cloths.end(), [](const ClothConfig& cloth) {
    return cloth.contact && cloth.contact->solids && cloth.contact->method == ContactMethod::impulses;
  });
  const auto add = [&](const std::string& name, const Wrench& load, const Eigen::Vector3d& origin) {
    Eigen::MatrixXd values(6, 1);
    values << load.force, load.torque - origin.cross(load.force);
    if (!known)
      values.setConstant(empty_cell);
    Columns columns("solid_fields", name, 1);
    columns.add(contact_columns, values.topRows(3));
    columns.add({"contact_mx [N m]", "contact_my [N m]", "contact_mz [N m]"}, values.bottomRows(3));
    columns.moveTo(out);
  };
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (scene.bodies[b].shape)
      add(scene.bodies[b].name, loads.bodies[b], state.bodies[b].X_WB.position);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    add(scene.obstacles[k].name, loads.obstacles[k], state.obstacles[k].position);
}

/// Curvature at an inner node [1/m]: 2 tan(turn / 2) over the mean length of its two edges, as for rods.
double threadCurvature(const ThreadState& thread, int node)
{
  const Eigen::Vector3d a = thread.edge(node - 1), b = thread.edge(node);
  const double turn = 2.0 * a.cross(b).norm() / (a.norm() * b.norm() + a.dot(b));
  return turn / (0.5 * (a.norm() + b.norm()));
}

/// One table per piece. All follows from the state: positions, velocities and volumes.
void addThread(const Simulation& simulation, int thread, const std::vector<RecordField>& fields,
               std::vector<FieldTable>& out)
{
  const bool curvature = asks(fields, RecordField::curvature), strain = asks(fields, RecordField::strain),
             force = asks(fields, RecordField::force);
  if (!curvature && !strain && !force)
    return;
  const ThreadModel& model = simulation.threadModel(thread);
  for (const ThreadState& piece : simulation.state().threads[static_cast<std::size_t>(thread)].threads)
  {
    const int nodes = piece.nodes(), edges = piece.edges();
    Columns columns("thread_fields", model.name, nodes);
    Eigen::MatrixXd names(2, nodes);
    Eigen::RowVectorXd kappa = Eigen::RowVectorXd::Zero(nodes), flux(nodes);
    Eigen::MatrixXd of_edges(3, edges);   // radius, stretch rate, tension
    for (int j = 0; j < edges; ++j)
    {
      const double length = piece.edge(j).norm(), radius = piece.radius(j);
      const double rate = (piece.v[j + 1] - piece.v[j]).dot(piece.edge(j)) / (length * length);
      of_edges.col(j) << radius, rate,
          3.0 * model.viscosity * M_PI * radius * radius * rate + M_PI * model.surface_tension * radius;
    }
    for (int i = 0; i < nodes; ++i)
    {
      names.col(i) << static_cast<double>(piece.thread_id), static_cast<double>(piece.id[i]);
      if (i > 0 && i + 1 < nodes)
        kappa[i] = threadCurvature(piece, i);
      const int before = std::max(i - 1, 0), after = std::min(i, edges - 1);
      // against the flow
      const Eigen::Vector3d along = (piece.edge(before).normalized() + piece.edge(after).normalized()).normalized();
      const double section =
          0.5 * M_PI * (of_edges(0, before) * of_edges(0, before) + of_edges(0, after) * of_edges(0, after));
      flux[i] = -section * piece.v[i].dot(along);
    }
    columns.add({"thread", "id"}, names);
    if (curvature)
      columns.add({"curvature [1/m]"}, kappa);
    if (strain)
    {
      columns.add({"radius [m]", "stretch_rate [1/s]"}, of_edges.topRows(2));
      columns.add({"flux [m^3/s]"}, flux);
    }
    if (force)
      columns.add({"tension [N]"}, of_edges.row(2));
    columns.moveTo(out);
  }
}

void addEnergies(const Simulation& simulation, std::vector<FieldTable>& out)
{
  const auto add = [&out](const std::string& object, double stretch, double bend, double twist, double kinetic,
                          double gravity) {
    Columns columns("energies", object, 1);
    columns.add({"stretch [J]", "bend [J]", "twist [J]", "kinetic [J]", "gravity [J]"},
                (Eigen::MatrixXd(5, 1) << stretch, bend, twist, kinetic, gravity).finished());
    columns.moveTo(out);
  };
  const SceneState& state = simulation.state();
  const SceneConfig& scene = simulation.config();
  for (std::size_t r = 0; r < state.rods.size(); ++r)
  {
    const RodEnergies e = simulation.energies(static_cast<int>(r));
    add(scene.rods[r].name, e.stretch, e.bend, e.twist, e.kinetic, e.gravity);
  }
  for (std::size_t k = 0; k < state.cloths.size(); ++k)
  {
    const ClothEnergies e = simulation.clothEnergies(static_cast<int>(k));
    add(scene.cloths[k].name, e.membrane, e.bending, empty_cell, e.kinetic, e.gravity);
  }
  for (std::size_t b = 0; b < state.bodies.size(); ++b)
    if (!simulation.config().bodies[b].motion)
    {
      const BodyConfig& body = scene.bodies[b];
      const RigidBodyState& s = state.bodies[b];
      const Eigen::Vector3d spin = s.X_WB.orientation.conjugate() * s.velocity.angular;
      const double kinetic = 0.5 * body.mass * s.velocity.linear.squaredNorm() + 0.5 * spin.dot(body.inertia * spin);
      add(body.name, empty_cell, empty_cell, empty_cell, kinetic,
          body.gravity ? -body.mass * scene.gravity.dot(s.X_WB.position) : 0.0);
    }
}

}   // namespace

std::vector<FieldTable> fieldTablesOf(const Simulation& simulation)
{
  std::vector<FieldTable> out;
  const std::vector<RecordField>& fields = simulation.config().record.fields;
  if (fields.empty())
    return out;
  for (std::size_t r = 0; r < simulation.state().rods.size(); ++r)
    addRod(simulation, static_cast<int>(r), fields, out);
  for (std::size_t k = 0; k < simulation.state().threads.size(); ++k)
    addThread(simulation, static_cast<int>(k), fields, out);
  for (std::size_t k = 0; k < simulation.state().cloths.size(); ++k)
    addCloth(simulation, static_cast<int>(k), fields, out);
  if (asks(fields, RecordField::contact_force))
    addSolids(simulation, out);
  if (asks(fields, RecordField::energy))
    addEnergies(simulation, out);
  return out;
}

}   // namespace slender
