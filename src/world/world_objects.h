#pragma once

#include <array>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "cloth/cloth_part.h"
#include "island/island.h"
#include "rod/rod_part.h"
#include "thread/thread_part.h"
#include "island_finder.h"
#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

/// The objects of a world, and the solids that they meet, as islands of them share them.
namespace slender {

struct Meeting;

/// A rod, a thread, a cloth or a simulated body: something of which an island has parts.
class WorldObject
{
public:
  explicit WorldObject(int number) : index(number) {}
  virtual ~WorldObject() = default;
  WorldObject(const WorldObject&) = delete;
  WorldObject& operator=(const WorldObject&) = delete;

  const int index;   ///< among the objects of its kind in the world
  int place = 0;     ///< in WorldObjects::all

  /// For messages: "rod 'rope'".
  virtual std::string name() const = 0;
  /// Loads the state where a step begins. Returns false, and fills the report, if the state or the inputs are not
  /// valid.
  virtual bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) = 0;
  /// Appends its parts of the present step, once the object is loaded.
  virtual void addParts(std::vector<Part*>& parts) = 0;
  /// What it may touch; without a box.
  virtual IslandFinder::Reach reach() const = 0;
  /// Writes the end of the step into the state.
  virtual void finish(WorldState& state) = 0;
  /// Of the barrier in the island that had the object last [N].
  virtual double& stiffness(WorldState& state) const = 0;
  /// Appends its surface in a state, if it has one.
  virtual void addTo(Meeting& meeting, const WorldState& state) = 0;
  bool hasSurface() const { return reach().has_points; }
};

class RodObject final : public WorldObject
{
public:
  RodObject(const WorldModel& world, int number, const TimeConfig& time);
  std::string name() const override { return "rod '" + stepper->model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override { parts.push_back(part.get()); }
  IslandFinder::Reach reach() const override;
  void finish(WorldState& state) override { state.rods[index] = stepper->work; }
  double& stiffness(WorldState& state) const override { return state.contact_stiffness.rods[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  /// Null: it may meet others, or tracks a guide.
  RodStepper* alone() { return meets || constraints ? nullptr : whole.get(); }
  /// Writes the guide and its forces into the state after a step, if the rod tracks a guide.
  void finishGuide(const WorldInputs& inputs, WorldState& state, StepReport& report) const;

  const std::unique_ptr<RodStepper> whole;
  RodStepper::Impl* const stepper;                            ///< of `whole`
  const std::shared_ptr<const WeakConstraints> constraints;   ///< null: tracks nothing
  const std::unique_ptr<RodPart> part;
  RodInputs inputs;   ///< of the present step, with the targets of grasps that driven bodies carry
  const bool meets;   ///< contact or welds may let it meet others

private:
  const std::optional<ContactProperties>& contact_;
  Eigen::Matrix3Xd targets_;   ///< of its averages at the end of the step [m]
  const double guide_size_;    ///< [m]
  const double duration_;      ///< of a step [s]
};

/// A simulated body.
class BodyObject final : public WorldObject
{
public:
  BodyObject(const WorldModel& world, int number);
  std::string name() const override { return "body '" + model_.body.name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override { parts.push_back(part.get()); }
  IslandFinder::Reach reach() const override;
  void finish(WorldState& state) override { state.bodies[index] = part->state(); }
  double& stiffness(WorldState& state) const override { return state.contact_stiffness.bodies[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  const std::unique_ptr<BodyPart> part;

private:
  const WorldModel::Body& model_;
};

/// A thread, with what has broken off it.
class ThreadObject final : public WorldObject
{
public:
  ThreadObject(const WorldModel& world, int number)
    : WorldObject(number),
      model(world.threads[number]),
      time_(world.time)
  {
  }
  std::string name() const override { return "thread '" + model.model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override;
  IslandFinder::Reach reach() const override;
  void finish(WorldState& state) override;
  double& stiffness(WorldState& state) const override { return state.contact_stiffness.threads[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  struct Strand
  {
    std::unique_ptr<ThreadStepper::Impl> stepper;
    std::unique_ptr<ThreadPart> part;
  };
  /// Strands of the present step.
  std::size_t strands() const { return work_.threads.size(); }
  Strand& strand(std::size_t number) { return strands_[number]; }

  const WorldModel::Thread& model;
  std::array<EndLoad, 2> loads;   ///< of the last step

private:
  void makeStrands(std::size_t count);

  const TimeConfig& time_;
  std::vector<Strand> strands_;   ///< as many as there have ever been at once
  ThreadInputs inputs_, still_;   ///< of the present step; without flow, for what has broken off
  ThreadGroupState work_;
};

class ClothObject final : public WorldObject
{
public:
  ClothObject(const WorldModel& world, int number, const TimeConfig& time);
  std::string name() const override { return "cloth '" + part->stages().model->name + "'"; }
  bool load(const WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addParts(std::vector<Part*>& parts) override { parts.push_back(part.get()); }
  IslandFinder::Reach reach() const override;
  void finish(WorldState& state) override { part->end(state.cloths[index]); }
  double& stiffness(WorldState& state) const override { return state.contact_stiffness.cloths[index]; }
  void addTo(Meeting& meeting, const WorldState& state) override;

  const std::unique_ptr<ClothPart> part;

private:
  const ContactProperties& contact_;
  const double duration_;   ///< of a step [s]
};

/// A solid that parts may touch.
struct WorldSolid
{
  enum class Kind
  {
    obstacle,
    body,
    floor   ///< on which a thread slips
  } kind;
  int index;                                   ///< of the obstacle, the body or the thread
  Obstacle obstacle;                           ///< what others touch
  BodyPart* body = nullptr;                    ///< that carries it; null: it moves as prescribed
  Pose X_BS{};                                 ///< in the frame of the body
  std::vector<const WorldObject*> ignores{};   ///< that never touch it: its body, and rods that are welded into it

  /// For a contact of these objects, without the pose.
  ContactSolid asTouched(const std::vector<WorldObject*>& by) const;
};

/// Objects of the world, by their numbers.
struct WorldContent
{
  std::vector<int> rods;   ///< those that may meet something come first
  std::vector<int> threads;
  std::vector<int> bodies;   ///< simulated ones, and driven ones that something is welded to or that have a shape
  std::vector<int> cloths;   ///< whose contact is the barrier
};

/// Returns true if contact or welds may let a rod meet something.
bool meetsOthers(const WorldModel& world, int rod);

struct WorldObjects
{
  /// Appends the grasps of the welds to the rods of the state, and makes room for the stiffnesses of contact. The model
  /// of the world must live as long.
  WorldObjects(const WorldModel& world, WorldContent content, WorldState& state);
  /// The bodies, and the rods that may meet something, for steps of another kind. The state has the grasps of the
  /// welds.
  WorldObjects(const WorldObjects& other, const TimeConfig& time);
  WorldObjects& operator=(const WorldObjects&) = delete;

  /// Takes the inputs of the rods for a step. Returns false, and fills the report, where the inputs do not fit the
  /// state or are not finite.
  bool takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report);

  const WorldModel& world;
  const WorldContent content;
  std::deque<BodyObject> bodies;
  std::deque<RodObject> rods;
  std::deque<ClothObject> cloths;
  std::deque<ThreadObject> threads;
  /// All of them in this order. Bodies come first, because rods follow them.
  std::vector<WorldObject*> all;
  std::vector<Weld> welds;                   ///< rod: place in `rods`; body: number in the world
  std::vector<std::pair<int, int>> joined;   ///< places in `all` of rods and simulated bodies that welds join
  std::vector<WorldSolid> solids;

  /// Null: the body is driven.
  const BodyObject* simulated(int body) const;

private:
  void addObjects(const TimeConfig& time);
  void add(WorldObject& object);
  bool touch() const;
  void addWelds(WorldState& state);
  void addSolids();
  void follow(const Weld& weld);
  std::string badInput(const WorldState& state, const WorldInputs& inputs) const;
  void carryGrasps(const WorldInputs& inputs);
};

}   // namespace slender
