#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slender_sim/cloth/cloth_group.h"
#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/rod/rigid_body.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/rod/rod_touch.h"
#include "slender_sim/thread/thread_model.h"
#include "slender_sim/thread/thread_touch.h"
#include "slender_sim/tracking/function_set.h"

namespace slender {

/// What a rod or a cloth follows by weak constraints.
struct TrackedGuide
{
  /// Sets of test functions. The first one acts at the start. Null: the part tracks nothing.
  std::shared_ptr<const std::vector<FunctionSet>> sets;
  double size = 1.0;   ///< of the guide [m]; errors are reported relative to it
  int leader = -1;     ///< the cloth of the world that is the guide; -1: the guide is an input
};

/// What a world consists of: its parts, what they may touch, and what joins them. Nothing of it changes while it moves.
struct WorldModel
{
  struct Rod
  {
    std::shared_ptr<const RodModel> model;
    std::optional<RodTouch> contact;   ///< nothing: touches nothing
    TrackedGuide tracked;              ///< with one set
  };
  struct Thread
  {
    std::shared_ptr<const ThreadModel> model;
    std::optional<ThreadTouch> contact;   ///< nothing: touches nothing but its floor
  };
  struct Cloth
  {
    std::shared_ptr<const ClothModel> model;
    ClothOptions options;
    std::optional<ClothContact> contact;   ///< nothing: touches nothing
    TrackedGuide tracked;
  };
  struct Body
  {
    RigidBodyModel body;
    std::optional<Shape> shape;   ///< that other parts touch; nothing: they pass through the body
    Pose X_BS;                    ///< the shape in the body's frame
    double friction = -1.0;       ///< negative: that of what touches it
  };
  /// A solid whose motion is an input.
  struct Obstacle
  {
    std::string name;
    Shape shape;
    double friction = -1.0;   ///< negative: that of what touches it
  };
  /// Holds nodes first..last of a rod as they lie in a body at the start.
  struct RodWeld
  {
    int rod = 0, first_node = 0, last_node = 0, body = 0;
  };

  std::vector<Rod> rods;
  std::vector<Thread> threads;
  std::vector<Cloth> cloths;
  std::vector<Body> bodies;
  std::vector<Obstacle> obstacles;
  std::vector<RodWeld> welds;   ///< ascending by body
  ContactOptions contact;       ///< of rods and threads; `least_stiffness` is chosen by what touches
  TimeConfig time;

  /// Whether a cloth is the guide of another one. Such cloths are stepped first and meet only each other.
  bool leads(int cloth) const;
};

}   // namespace slender
