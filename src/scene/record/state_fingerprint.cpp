#include "byte_archive.h"
#include "state_file.h"

namespace slender {

namespace {

/// Writes what a state depends on.
class Fingerprint
{
public:
  void add(const TimeConfig& time)
  {
    out.all(time.step, time.integrator, time.spectral_radius, time.error_tolerance, time.min_step,
            time.newton.tolerance, time.newton.max_iterations, time.newton.max_cuts);
  }

  void add(const RodConfig& config, const RodModel& model)
  {
    addName(model.name);
    out.all(model.closed, model.isotropic, model.inextensible, model.curvature, model.mass, model.rest_length,
            model.stretch_modulus, model.radius_a, model.radius_b, model.twist_modulus, model.rest_twist, model.drag,
            model.bend_modulus, model.rest_curvature, model.mass_damping, model.stiffness_damping, model.isotropic,
            model.inextensible);
    addGrasps(config.grasps);
    for (const RodLoadConfig& load : config.loads)
      out.all(load.node, load.arc_length, load.force, load.torque);
    if (const auto& tracking = config.tracking)
      addTracking(*tracking);
    addTouching(config.contact);
  }

  void add(const WorldModel::Thread& thread)
  {
    const ThreadModel& model = *thread.model;
    const auto& floor = model.floor;
    const auto& limits = model.limits;
    addName(model.name);
    out.all(model.density, model.viscosity, model.surface_tension, model.nozzle_diameter, model.feed_length,
            floor.height, limits.max_edge_length, limits.min_edge_length, limits.min_radius, limits.edge_grading,
            limits.highest_edge_length, limits.max_step, floor.present, floor.friction, limits.max_deposited);
  }

  void add(const ClothConfig& config, const ClothModel& model)
  {
    addName(model.name);
    out(model.rest.vertices);
    out(static_cast<std::uint64_t>(model.rest.triangles.cols()));
    for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
      for (int corner = 0; corner < 3; ++corner)
        out(model.rest.triangles(corner, f));
    out.all(model.mass, model.warp, model.undeformed);
    addMaterial(config, model);
    if (const auto& tracking = config.tracking)
      addTracking(*tracking);
    addTouching(config.contact);
    const ContactProperties touch = config.contact.value_or(ContactProperties{});
    out.all(touch.thickness, touch.method);
    addGrasps(config.grasps);
    for (const char face : model.clamped_faces)
      out(static_cast<int>(face));
    for (const ClothLoadConfig& load : config.loads)
    {
      for (const int vertex : load.vertices)
        out(vertex);
      out(load.force);
    }
  }

  void addName(const std::string& name)
  {
    out(static_cast<std::uint64_t>(name.size()));
    for (char c : name)
      out(c);
  }

  void addTouching(const std::optional<ContactProperties>& contact)
  {
    const ContactProperties touch = contact.value_or(ContactProperties{});
    out.all(contact.has_value(), touch.self, touch.others, touch.solids, touch.friction);
  }

  ByteWriter out;

private:
  void addGrasps(const std::vector<GraspConfig>& grasps)
  {
    for (const GraspConfig& grasp : grasps)
    {
      addName(grasp.name);
      out(grasp.attach);
    }
  }

  void addTracking(const TrackingConfig& tracking)
  {
    out(tracking.guide.mesh.vertices);
    out(static_cast<std::uint64_t>(tracking.sets.size()));
    for (const FunctionSet& set : tracking.sets)
    {
      addName(set.name);
      out.all(set.from.value_or(0.0), set.blend, set.bounds);
      for (const WeakConstraints::Matrix* weights : {&set.constraints->matrix(), &set.constraints->guideMatrix()})
      {
        out(static_cast<std::uint64_t>(weights->rows()));
        for (Eigen::Index i = 0; i < weights->rows(); ++i)
          for (WeakConstraints::Matrix::InnerIterator entry(*weights, i); entry; ++entry)
            out.all(static_cast<int>(i), static_cast<int>(entry.col()), entry.value());
      }
    }
  }

  void addMaterial(const ClothConfig& config, const ClothModel& model)
  {
    const auto& [c11, c12, c22, c33] = model.membrane;
    out.all(c11, c12, c22, c33, model.bending_modulus, model.mass_damping, model.stiffness_damping,
            model.wind_coefficient, model.aerodynamics.air_density, model.aerodynamics.drag, model.aerodynamics.lift,
            model.plasticity.yield_curvature, model.plasticity.hardening, model.plasticity.creep_time,
            config.linear_tolerance, model.bending);
    if (model.bending_poissons_ratio)
      out(*model.bending_poissons_ratio);
    out.all(config.solver, config.one_newton_step);
  }
};

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
    out.all(body.motion.has_value(), body.mass, body.inertia, static_cast<std::uint64_t>(body.welds.size()));
  }
  for (const ObstacleConfig& obstacle : config.obstacles)
    print.addName(obstacle.name);
  out(config.contact.gap);
  Checksum checksum;
  checksum.add(out.bytes().data(), out.bytes().size());
  return checksum.value();
}

}   // namespace slender
