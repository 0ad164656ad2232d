#pragma once

#include <memory>
#include <vector>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "test/support/cloths.h"
#include "cloth/cloth_part.h"
#include "island/island.h"
#include "rod/rod_part.h"

namespace slender::test {

constexpr double kIslandStep = 0.005, kIslandGap = 1e-3;   // [s], [m]

/// A square sheet of cotton [m].
inline std::shared_ptr<ClothModel> cotton(double size, int cells)
{
  auto model = std::make_shared<ClothModel>(buildCloth(
      "sheet", gridMesh(size, size, cells, cells, GridPattern::alternating), 0.2, isotropicMembrane(100.0, 0.3, 1.0)));
  model->bending = BendingModel::hinge;
  model->bending_modulus = 1e-5;
  return model;
}

/// Its vertices [m] when it lies flat about a point.
inline Matrix3Xd centred(const ClothModel& model, const Vector3d& middle)
{
  const Vector3d own = model.rest.vertices.rowwise().mean();
  return model.rest.vertices.colwise() + (middle - own);
}

/// Cloths, rods and a body in one island, with solids that stand still, stepped without a world around it.
class ClothIsland
{
public:
  struct Cloth
  {
    std::shared_ptr<ClothModel> model;
    ClothState state;
    ClothInputs inputs;
    std::unique_ptr<ClothPart> part;
  };
  struct Rod
  {
    std::unique_ptr<RodWork> stepper;
    std::unique_ptr<RodPart> part;
    RodInputs inputs;
    RodState state;
  };
  struct Body
  {
    std::unique_ptr<BodyPart> part;
    RigidBodyState state;
    Shape shape;
  };

  ClothIsland(double step, double gap) : step_(step), stepper_(timeOf(step), false) { options_.gap = gap; }

  Cloth& addCloth(std::shared_ptr<ClothModel> model, const Eigen::Matrix3Xd& x, double thickness,
                  const std::vector<int>& pins = {})
  {
    cloths.push_back({model, makeClothState(*model, x), {}, nullptr});
    Cloth& cloth = cloths.back();
    pinVertices(cloth.state, pins);
    cloth.inputs.pins.resize(3, static_cast<Eigen::Index>(pins.size()));
    for (std::size_t k = 0; k < pins.size(); ++k)
      cloth.inputs.pins.col(static_cast<Eigen::Index>(k)) = x.col(pins[k]);
    ClothOptions options;
    options.newton = timeOf(step_).newton;
    cloth.part = std::make_unique<ClothPart>(model, options);
    ContactProperties contact;
    contact.thickness = thickness;
    cloth.part->setContact(contact, step_);
    return cloth;
  }
  void addRod(std::shared_ptr<const RodModel> model, const RodState& state)
  {
    rods.push_back({std::make_unique<RodWork>(model, timeOf(step_)), nullptr, {}, state});
    rods.back().part = std::make_unique<RodPart>(*rods.back().stepper, true);
    rods.back().part->setContact({});
  }
  void addBody(const RigidBodyModel& model, const Shape& shape, const Pose& pose)
  {
    bodies.push_back({std::make_unique<BodyPart>(model), {}, shape});
    bodies.back().state.X_WB = pose;
    bodies.back().part->setReach(boundingRadius(shape));
  }
  void addSolid(const Shape& shape, const Pose& pose)
  {
    shapes_.push_back(shape);
    poses_.push_back(pose);
  }

  StepReport step()
  {
    if (!begun_)
      begin();
    begun_ = true;
    for (Body& body : bodies)
      body.part->begin(body.state, gravity);
    for (Rod& rod : rods)
    {
      rod.inputs.gravity = gravity;
      rod.stepper->begin(rod.state, rod.inputs, step_);
    }
    for (Cloth& cloth : cloths)
    {
      cloth.inputs.gravity = gravity;
      cloth.part->begin(cloth.state, cloth.inputs, step_);
    }
    double first = 0.0;
    const StepReport report = stepper_.step(step_, first);
    if (!report.ok)
      return report;
    for (Body& body : bodies)
      body.state = body.part->state();
    for (Rod& rod : rods)
      rod.state = rod.stepper->work;
    for (Cloth& cloth : cloths)
      cloth.part->end(cloth.state);
    return report;
  }

  /// By a potential of its own, which has not made the step [m].
  double clearance()
  {
    ContactSurface surface;
    Eigen::Matrix3Xd x;
    const auto add = [&](const Part& part, const Eigen::Matrix3Xd& points) {
      part.addSurface(surface);
      x.conservativeResize(3, x.cols() + points.cols());
      x.rightCols(points.cols()) = points;
    };
    for (const Rod& rod : rods)
      add(*rod.part, rod.state.x);
    for (const Cloth& cloth : cloths)
      add(*cloth.part, cloth.state.x);
    surface.solids = solids();
    std::vector<Pose> poses;
    for (const Body& body : bodies)
      poses.push_back(body.state.X_WB);
    poses.insert(poses.end(), poses_.begin(), poses_.end());
    return ContactPotential(surface, options_).clearance(x, poses);
  }
  ContactPotential& contact() { return *stepper_.equations().contact(); }
  Island& stepper() { return stepper_; }

  Eigen::Vector3d gravity{0, 0, -9.81};
  std::vector<Part*> others;   ///< which load themselves
  std::vector<Cloth> cloths;
  std::vector<Rod> rods;
  std::vector<Body> bodies;

private:
  static TimeConfig timeOf(double step)
  {
    TimeConfig time;
    time.step = step;
    time.integrator = Integrator::implicit_euler;
    return time;
  }
  std::vector<ContactSolid> solids() const
  {
    std::vector<ContactSolid> all;
    for (const Body& body : bodies)
    {
      all.push_back({{body.shape, -1.0, {}}});
      all.back().body = true;
    }
    for (const Shape& shape : shapes_)
      all.push_back({{shape, -1.0, {}}});
    return all;
  }
  void begin()
  {
    std::vector<Part*> parts;
    for (Body& body : bodies)
      parts.push_back(body.part.get());
    for (Rod& rod : rods)
      parts.push_back(rod.part.get());
    for (Cloth& cloth : cloths)
      parts.push_back(cloth.part.get());
    parts.insert(parts.end(), others.begin(), others.end());
    stepper_.setParts(parts);
    for (Body& body : bodies)
    {
      stepper_.equations().solids.emplace_back();
      stepper_.equations().solids.back().body = body.part.get();
    }
    for (const Pose& pose : poses_)
    {
      stepper_.equations().solids.emplace_back();
      stepper_.equations().solids.back().start = pose;
      stepper_.equations().solids.back().target.X_WG = pose;
    }
    stepper_.setContact(solids(), options_);
  }

  double step_;
  bool begun_ = false;
  ContactOptions options_;
  Island stepper_;
  std::vector<Shape> shapes_;
  std::vector<Pose> poses_;
};

}   // namespace slender::test
