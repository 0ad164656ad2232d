#include "state_fingerprint.h"

#include "byte_archive.h"

namespace slender {

std::uint64_t stateFingerprint(const SceneConfig& config, const WorldModel& world)
{
  ByteWriter out;
  const auto text = [&out](const std::string& word) {
    out(static_cast<std::uint64_t>(word.size()));
    for (char c : word)
      out(c);
  };
  const auto tracked = [&](const TrackingConfig& tracking) {
    out(tracking.guide.mesh.vertices);
    out(static_cast<std::uint64_t>(tracking.sets.size()));
    for (const FunctionSet& set : tracking.sets)
    {
      text(set.name);
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
  };
  const auto touching = [&out](const std::optional<ContactProperties>& contact) {
    const ContactProperties touch = contact.value_or(ContactProperties{});
    out(contact.has_value());
    out(touch.self);
    out(touch.others);
    out(touch.solids);
    out(touch.friction);
  };
  out(config.gravity);
  const TimeConfig& time = config.time;
  out(time.step);
  out(static_cast<int>(time.integrator));
  out(time.spectral_radius);
  out(time.error_tolerance);
  out(time.min_step);
  out(time.newton.tolerance);
  out(time.newton.max_iterations);
  out(time.newton.max_cuts);
  for (std::size_t r = 0; r < world.rods.size(); ++r)
  {
    const RodModel& model = *world.rods[r].model;
    text(model.name);
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
    for (const GraspConfig& grasp : config.rods[r].grasps)
    {
      text(grasp.name);
      out(static_cast<int>(grasp.attach));
    }
    for (const RodLoadConfig& load : config.rods[r].loads)
    {
      out(load.node);
      out(load.arc_length);
      out(load.force);
      out(load.torque);
    }
    if (const auto& tracking = config.rods[r].tracking)
      tracked(*tracking);
    touching(config.rods[r].contact);
  }
  for (const WorldModel::Thread& thread : world.threads)
  {
    const auto& model = thread.model;
    text(model->name);
    for (const double value :
         {model->density, model->viscosity, model->surface_tension, model->nozzle_diameter, model->feed_length,
          model->floor.height, model->limits.max_edge_length, model->limits.min_edge_length, model->limits.min_radius,
          model->limits.edge_grading, model->limits.highest_edge_length, model->limits.max_step})
      out(value);
    out(model->floor.present);
    out(model->floor.friction);
    out(model->limits.max_deposited);
  }
  for (const ThreadConfig& thread : config.threads)
  {
    touching(thread.contact);
    out(thread.merging);
  }
  for (std::size_t k = 0; k < world.cloths.size(); ++k)
  {
    const ClothModel& model = *world.cloths[k].model;
    text(model.name);
    out(model.rest.vertices);
    out(static_cast<std::uint64_t>(model.rest.triangles.cols()));
    for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
      for (int corner = 0; corner < 3; ++corner)
        out(model.rest.triangles(corner, f));
    out(model.mass);
    out(model.warp);
    out(model.undeformed);
    for (const double value :
         {model.membrane.c11, model.membrane.c12, model.membrane.c22, model.membrane.c33, model.bending_modulus,
          model.mass_damping, model.stiffness_damping, model.wind_coefficient, model.aerodynamics.air_density,
          model.aerodynamics.drag, model.aerodynamics.lift, model.plasticity.yield_curvature,
          model.plasticity.hardening, model.plasticity.creep_time, config.cloths[k].linear_tolerance})
      out(value);
    out(static_cast<int>(model.bending));
    if (model.bending_poissons_ratio)
      out(*model.bending_poissons_ratio);
    out(static_cast<int>(config.cloths[k].solver));
    out(config.cloths[k].one_newton_step);
    if (const auto& tracking = config.cloths[k].tracking)
      tracked(*tracking);
    touching(config.cloths[k].contact);
    out(config.cloths[k].contact.value_or(ContactProperties{}).thickness);
    out(static_cast<int>(config.cloths[k].contact.value_or(ContactProperties{}).method));
    for (const GraspConfig& grasp : config.cloths[k].grasps)
    {
      text(grasp.name);
      out(static_cast<int>(grasp.attach));
    }
    for (const char face : model.clamped_faces)
      out(static_cast<int>(face));
    for (const ClothLoadConfig& load : config.cloths[k].loads)
    {
      for (const int vertex : load.vertices)
        out(vertex);
      out(load.force);
    }
  }
  for (const BodyConfig& body : config.bodies)
  {
    text(body.name);
    out(body.motion.has_value());
    out(body.mass);
    out(body.inertia);
    out(static_cast<std::uint64_t>(body.welds.size()));
  }
  for (const ObstacleConfig& obstacle : config.obstacles)
    text(obstacle.name);
  out(config.contact.gap);
  Checksum checksum;
  checksum.add(out.bytes().data(), out.bytes().size());
  return checksum.value();
}

}   // namespace slender
