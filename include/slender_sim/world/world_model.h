#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/contact/contact_properties.h"
#include "slender_sim/contact/obstacle.h"
#include "slender_sim/rod/rigid_body.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/thread/thread_model.h"
#include "slender_sim/tracking/function_set.h"
#include "slender_sim/world/world_state.h"

namespace slender {

/// The guide that a rod or a cloth follows by weak constraints.
struct TrackedGuide
{
  /// Sets of test functions. The first one acts at the start. Null: the part tracks nothing.
  std::shared_ptr<const std::vector<FunctionSet>> sets;
  double size = 1.0;   ///< of the guide [m]; errors are reported relative to it
  int leader = -1;     ///< the cloth of the world that is the guide; -1: the guide is an input
  int input = 0;       ///< number of the guide in WorldInputs::guides
};

/// The constant data of a world: its parts, the contacts that are possible, and the joints between parts.
struct WorldModel
{
  struct Rod
  {
    std::shared_ptr<const RodModel> model;
    std::optional<ContactProperties> contact;   ///< nothing: touches nothing
    std::vector<IgnoredSolid> ignored;          ///< obstacles, by number, that nodes of the rod pass through
    TrackedGuide tracked;                       ///< with one set
  };
  struct Thread
  {
    std::shared_ptr<const ThreadModel> model;
    std::optional<ContactProperties> contact;   ///< nothing: touches nothing but its floor
    /// Surface tension draws parts that touch into each other (thesis 5.4.3), until the distance of their centrelines
    /// is this share of the sum of their radii; there they touch. In [0, 1); 0: they do not merge. Half discs of one
    /// round section have their centroids at 0.6.
    double merging = 0.0;
  };
  struct Cloth
  {
    std::shared_ptr<const ClothModel> model;
    ClothOptions options;
    std::optional<ContactProperties> contact;   ///< nothing: touches nothing
    /// Obstacles, by number, that vertices of the cloth pass through. With the impulse method the whole cloth passes.
    std::vector<IgnoredSolid> ignored;
    TrackedGuide tracked;
  };
  struct Body
  {
    RigidBodyModel body;
    /// Shape that other parts touch. With nothing they pass through the body. Simulated bodies touch obstacles and
    /// other bodies, if contact.gap is not 0.
    std::optional<Shape> shape;
    Pose X_BS;                ///< the shape in the body's frame
    double friction = -1.0;   ///< as Obstacle::friction

    /// Returns the obstacle that other parts touch. There must be a shape.
    Obstacle solid() const { return {*shape, friction, body.name}; }
  };
  /// Welds nodes first..last of a rod to a body.
  struct RodWeld
  {
    int rod = 0, first_node = 0, last_node = 0, body = 0;
    std::optional<Pose> X_BG;   ///< pose of the held part in the body's frame; nothing: the initial pose
  };

  std::vector<Rod> rods;
  std::vector<Thread> threads;
  std::vector<Cloth> cloths;
  std::vector<Body> bodies;
  std::vector<Obstacle> obstacles;   ///< their motions are inputs
  std::vector<RodWeld> welds;        ///< ascending by body
  ContactOptions contact;   ///< for contact by the barrier; `least_stiffness` is chosen from the objects in contact
  TimeConfig time;

  /// Returns true if a cloth is the guide of another one. Such cloths are stepped first and touch only each other.
  bool leads(int cloth) const;
  /// What a rod or a cloth tracks.
  const TrackedGuide& tracked(const ObjectRef& of) const
  {
    return of.isCloth() ? cloths.at(of.index).tracked : rods.at(of.index).tracked;
  }
};

}   // namespace slender
