#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// An event: a value begins to exceed its limit.
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
  double value = 0.0;   ///< in the unit of the limit
  double limit = 0.0;
  std::vector<int> to_release;   ///< grasps that `on_limit: release` releases
  std::string text;              ///< "grasp 'left': its force 41 N exceeds limits.force = 40 N (t = 1.2 s)"
};

/// Checks the limits of a scene (key `limits`) in each step, and reacts as `on_limit` says. An excursion begins when a
/// value exceeds its limit and ends when the value is below 95 % of the limit. The reaction depends only on states and
/// inputs, so that a repeated run with the same inputs gives the same result.
class LimitWatch
{
public:
  /// The simulation must outlive the watch.
  explicit LimitWatch(Simulation& simulation);

  /// Checks the speeds of the inputs of the next step. Call it before the step. While inputs are held, it replaces all
  /// targets by the present places of the objects. Returns the excursions that begin.
  std::vector<LimitExcess> checkInputs(SceneInputs& inputs);
  /// Checks strains, forces and torques. Call it after a step. Returns the excursions that begin.
  std::vector<LimitExcess> checkStep();

  /// A grasp, and the text of the excess because of which `on_limit: release` released it.
  struct Release
  {
    int grasp;
    std::string why;
  };
  /// Returns what the last check released.
  const std::vector<Release>& released() const { return released_; }
  /// Returns the reason why the simulation must stop (`on_limit: stop`); otherwise empty.
  const std::string& stopped() const { return stopped_; }
  /// Returns the reason why inputs are held (`on_limit: hold`); otherwise empty.
  const std::string& held() const { return held_; }
  /// Ends the holding of inputs. A value that exceeds its limit now can hold them again only after its excursion ended.
  void goOn();
  /// Forgets all excursions. Call it after the state was replaced.
  void reset();

  /// Returns the present excursions, one text each.
  std::vector<std::string> lasting() const;
  /// Returns the number of excursions that have begun so far.
  std::uint64_t count() const { return count_; }

private:
  using Key = std::pair<LimitExcess::Kind, int>;   ///< kind, and index of the object, grasp or input
  struct Excursion
  {
    LimitExcess worst;
    double next_action = 0.0;   ///< [s] simulated time of the next release
  };

  bool isQuiet(const Key& key, double value, double limit) const;
  void look(const Key& key, double value, double limit, const std::string& subject, const char* unit,
            std::vector<int> to_release, std::vector<LimitExcess>& begun);
  void act(Excursion& excursion);
  void holdInputs(SceneInputs& inputs) const;
  void checkStrains(std::vector<LimitExcess>& begun);
  template <class Stretch, class Name>
  void checkStrain(const Key& key, double limit, int edges, const Stretch& stretch, const Name& name,
                   const ObjectRef& object, std::vector<LimitExcess>& begun);
  std::vector<int> mostLoaded(const ObjectRef& object) const;

  Simulation& simulation_;
  const LimitsConfig limits_;
  std::vector<std::vector<double>> cloth_lengths_;   ///< per cloth: rest lengths of the edges of its mesh [m]
  std::vector<double> rod_strain_limits_;
  double cloth_strain_limit_ = kSoftStrain;
  std::map<Key, Excursion> excursions_;
  std::vector<Release> released_;
  std::string stopped_, held_;
  std::uint64_t count_ = 0;
};

}   // namespace slender
