#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender {

const char* toString(OnLimit on_limit);

/// One limit that is exceeded.
struct LimitExcess
{
  enum class Kind
  {
    strain,
    force,
    torque,
    speed
  };
  Kind kind = Kind::strain;
  double time = 0.0;    ///< [s] simulated, when it was noticed
  double value = 0.0;   ///< in the unit of the limit
  double limit = 0.0;
  std::vector<int> to_release;   ///< grasps that `release` lets go
  std::string text;              ///< "grasp 'left': its force 41 N exceeds limits.force = 40 N (t = 1.2 s)"
};

/// Watches the limits of a scene (key `limits`) step by step, and does what `on_limit` asks for. An excursion begins
/// when a value exceeds its limit and ends below 95 % of it. What the watch does depends on the states and inputs
/// alone, so that a run that is repeated with the same inputs is the same.
class LimitWatch
{
public:
  /// The simulation outlives the watch.
  explicit LimitWatch(Simulation& simulation);

  /// Before a step: looks at the speeds of its inputs. While inputs are held, replaces all targets by where things are.
  /// Returns the excursions that begin.
  std::vector<LimitExcess> checkInputs(SceneInputs& inputs);
  /// After a step: looks at strains, forces and torques. Returns the excursions that begin.
  std::vector<LimitExcess> checkStep();

  /// With `release`: the grasps that the last check released.
  const std::vector<int>& released() const { return released_; }
  /// With `stop`: why the simulation must not go on; otherwise empty.
  const std::string& stopped() const { return stopped_; }
  /// With `hold`: why inputs are held; otherwise empty.
  const std::string& held() const { return held_; }
  /// Inputs count again. What exceeds its limit now holds them anew only when it has been below it.
  void goOn();
  /// The state was replaced.
  void reset();

  /// The excursions that last, one text each.
  std::vector<std::string> lasting() const;
  /// How many have begun so far.
  std::uint64_t count() const { return count_; }

private:
  using Key = std::pair<LimitExcess::Kind, int>;   ///< and the index of the object, grasp or input
  struct Excursion
  {
    LimitExcess worst;
    double next_action = 0.0;   ///< [s] simulated
  };

  bool isQuiet(const Key& key, double value, double limit) const;
  void look(const Key& key, double value, double limit, const std::string& subject, const char* unit,
            std::vector<int> to_release, std::vector<LimitExcess>& begun);
  void act(Excursion& excursion);
  void holdInputs(SceneInputs& inputs) const;
  void checkStrains(std::vector<LimitExcess>& begun);
  void checkRodStrain(int rod, std::vector<LimitExcess>& begun);
  void checkClothStrain(int cloth, std::vector<LimitExcess>& begun);
  std::vector<int> mostLoaded(int rod, int cloth) const;

  Simulation& simulation_;
  const LimitsConfig limits_;
  /// per cloth: the edges of its mesh, and their lengths at rest [m]
  std::vector<std::vector<std::pair<int, int>>> cloth_edges_;
  std::vector<std::vector<double>> cloth_lengths_;
  std::map<Key, Excursion> excursions_;
  std::vector<int> released_;
  std::string stopped_, held_;
  std::uint64_t count_ = 0;
};

}   // namespace slender
