#include "state_fingerprint.h"

#include "byte_archive.h"

namespace slender {

namespace {

/// Writes what a state depends on.
class Fingerprint
{
public:
  void add(const TimeConfig& time);
  void add(const RodConfig& config, const RodModel& model);
  void add(const WorldModel::Thread& thread);
  void add(const ClothConfig& config, const ClothModel& model);
  void addName(const std::string& name);
  void addTouching(const std::optional<ContactProperties>& contact);

  ByteWriter out;

private:
  void addTracking(const TrackingConfig& tracking);
  void addMaterial(const ClothConfig& config, const ClothModel& model);
};

void Fingerprint::addName(const std::string& name)
{
  out(static_cast<std::uint64_t>(name.size()));
  for (char c : name)
    out(c);
}

void Fingerprint::addTracking(const TrackingConfig& tracking)
{
  out(tracking.guide.mesh.vertices);
  out(static_cast<std::uint64_t>(tracking.sets.size()));
  for (const FunctionSet& set : tracking.sets)
  {
    addName(set.name);
    out(set.from.value_or(0.0));
    out(set.blend);
    out(set.bounds);
    for (const WeakConstraints::Matrix* weights : {&set.constraints->matrix(), &set.constraints->guideMatrix()})
    {
      out(static_cast<std::uint64_t>(weights->rows()));
      for (Eigen::Index i = 0; i < weights->rows(); ++i)
      {
        for (WeakConstraints::Matrix::InnerIterator entry(*weights, i); entry; ++entry)
        {
          out(static_cast<int>(i));
          out(static_cast<int>(entry.col()));
          out(entry.value());
        }
      }
    }
  }
}

void Fingerprint::addTouching(const std::optional<ContactProperties>& contact)
{
  const ContactProperties touch = contact.value_or(ContactProperties{});
  out(contact.has_value());
  out(touch.self);
  out(touch.others);
  out(touch.solids);
  out(touch.friction);
}

void Fingerprint::add(const TimeConfig& time)
{
  out(time.step);
  out(static_cast<int>(time.integrator));
  out(time.spectral_radius);
  out(time.error_tolerance);
  out(time.min_step);
  out(time.newton.tolerance);
  out(time.newton.max_iterations);
  out(time.newton.max_cuts);
}

void Fingerprint::add(const RodConfig& config, const RodModel& model)
{
  addName(model.name);
  out(model.closed);
  out(model.isotropic);
  out(model.inextensible);
  out(static_cast<int>(model.curvature));
  for (const Eigen::VectorXd* values : {&model.mass, &model.rest_length, &model.stretch_modulus, &model.radius_a,
                                        &model.radius_b, &model.twist_modulus, &model.rest_twist, &model.drag})
    out(*values);
  out(model.bend_modulus);
  out(model.rest_curvature);
  out(model.mass_damping);
  out(model.stiffness_damping);
  out(model.isotropic);
  out(model.inextensible);
  for (const GraspConfig& grasp : config.grasps)
  {
    addName(grasp.name);
    out(static_cast<int>(grasp.attach));
  }
  for (const RodLoadConfig& load : config.loads)
  {
    out(load.node);
    out(load.arc_length);
    out(load.force);
    out(load.torque);
  }
  if (const auto& tracking = config.tracking)
    addTracking(*tracking);
  addTouching(config.contact);
}

void Fingerprint::add(const WorldModel::Thread& thread)
{
  const auto& model = thread.model;
  addName(model->name);
  for (const double value :
       {model->density, model->viscosity, model->surface_tension, model->nozzle_diameter, model->feed_length,
        model->floor.height, model->limits.max_edge_length, model->limits.min_edge_length, model->limits.min_radius,
        model->limits.edge_grading, model->limits.highest_edge_length, model->limits.max_step})
    out(value);
  out(model->floor.present);
  out(model->floor.friction);
  out(model->limits.max_deposited);
}

void Fingerprint::addMaterial(const ClothConfig& config, const ClothModel& model)
{
  for (const double value :
       {model.membrane.c11, model.membrane.c12, model.membrane.c22, model.membrane.c33, model.bending_modulus,
        model.mass_damping, model.stiffness_damping, model.wind_coefficient, model.aerodynamics.air_density,
        model.aerodynamics.drag, model.aerodynamics.lift, model.plasticity.yield_curvature, model.plasticity.hardening,
        model.plasticity.creep_time, config.linear_tolerance})
    out(value);
  out(static_cast<int>(model.bending));
  if (model.bending_poissons_ratio)
    out(*model.bending_poissons_ratio);
  out(static_cast<int>(config.solver));
  out(config.one_newton_step);
}

void Fingerprint::add(const ClothConfig& config, const ClothModel& model)
{
  addName(model.name);
  out(model.rest.vertices);
  out(static_cast<std::uint64_t>(model.rest.triangles.cols()));
  for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
    for (int corner = 0; corner < 3; ++corner)
      out(model.rest.triangles(corner, f));
  out(model.mass);
  out(model.warp);
  out(model.undeformed);
  addMaterial(config, model);
  if (const auto& tracking = config.tracking)
    addTracking(*tracking);
  addTouching(config.contact);
  out(config.contact.value_or(ContactProperties{}).thickness);
  out(static_cast<int>(config.contact.value_or(ContactProperties{}).method));
  for (const GraspConfig& grasp : config.grasps)
  {
    addName(grasp.name);
    out(static_cast<int>(grasp.attach));
  }
  for (const char face : model.clamped_faces)
    out(static_cast<int>(face));
  for (const ClothLoadConfig& load : config.loads)
  {
    for (const int vertex : load.vertices)
      out(vertex);
    out(load.force);
  }
}

}   // namespace

std::uint64_t stateFingerprint(const SceneConfig& config, const WorldModel& world)
{
  Fingerprint print;
  ByteWriter& out = print.out;
  out(config.gravity);
  print.add(config.time);
  for (std::size_t r = 0; r < world.rods.size(); ++r)
    print.add(config.rods[r], *world.rods[r].model);
  for (const WorldModel::Thread& thread : world.threads)
    print.add(thread);
  for (const ThreadConfig& thread : config.threads)
  {
    print.addTouching(thread.contact);
    out(thread.merging);
  }
  for (std::size_t k = 0; k < world.cloths.size(); ++k)
    print.add(config.cloths[k], *world.cloths[k].model);
  for (const BodyConfig& body : config.bodies)
  {
    print.addName(body.name);
    out(body.motion.has_value());
    out(body.mass);
    out(body.inertia);
    out(static_cast<std::uint64_t>(body.welds.size()));
  }
  for (const ObstacleConfig& obstacle : config.obstacles)
    print.addName(obstacle.name);
  out(config.contact.gap);
  Checksum checksum;
  checksum.add(out.bytes().data(), out.bytes().size());
  return checksum.value();
}

}   // namespace slender
