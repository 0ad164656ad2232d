#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <vector>

#include "confined_newton.h"
#include "island/part.h"
#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/geometry/pose_motion.h"

namespace slender {

/// A potential of surface points besides contact, for example the attraction of threads that merge.
class SurfacePotential
{
public:
  virtual ~SurfacePotential() = default;
  /// Returns the potential [J] at points x and, on request, fills the stiffness of its terms.
  virtual double evaluate(const Eigen::Matrix3Xd& x, bool with_stiffness) = 0;
  virtual const std::vector<ContactTerm>& terms() const = 0;
};

/// A solid that surface points may touch.
struct IslandSolid
{
  RigidPart* body = nullptr;   ///< the part that carries the solid; null: it moves as prescribed
  Pose X_BS;                   ///< the solid in the frame of the body, or of what moves as prescribed
  Pose start;                  ///< of a prescribed frame, when the time step begins
  Twist start_velocity;
  GraspTarget target;   ///< of a prescribed frame, when it ends
};

/// How Newton's method ends, which differs by what the parts are.
struct IslandTolerances
{
  double least_edge = std::numeric_limits<double>::infinity();   ///< shortest edge of all parts [m]
  /// A stage may end at a saddle of the angles of kinked joints, when positions have arrived.
  bool angles_may_keep_shift = false;
  double most_unbalanced = std::numeric_limits<double>::infinity();   ///< force, over the largest one
};

/// The energy of several parts with contact as one system for minimize() and minimizeConfined(). Parts that are coupled
/// share one sparse matrix. All other parts solve with their own matrices.
class Equations
{
public:
  /// `simplicial`: see SparseCholesky.
  explicit Equations(bool simplicial) : matrix_(simplicial) {}

  // ---- what the island consists of
  void setParts(const std::vector<Part*>& parts);
  std::vector<IslandSolid> solids;   ///< in the order of those of the contact
  IslandTolerances tolerances;
  /// Solver of the shared matrix; automatic: by what meets, see chooseSolver().
  IslandSolver solver = IslandSolver::automatic;
  /// Where the parts meet each other and solids. Without a call nothing touches.
  void setContact(ContactSurface surface, const ContactOptions& options);
  /// A potential of the surface points besides contact; null: none.
  void setAttraction(SurfacePotential* attraction) { attraction_ = attraction; }
  /// Sets how many threads evaluate parts and contact and factor the shared matrix. 0: see parallelFor().
  void setThreads(int threads);
  ContactPotential* contact() { return contact_.get(); }   ///< null: nothing touches
  const ContactPotential* contact() const { return contact_.get(); }

  // ---- a step. Fractions are of this step.
  void beginStep(double duration) { duration_ = duration, linear_iterations_ = 0; }   ///< [s]
  /// Friction sticks as in steps of at most this duration [s]; by default, of any.
  void setFrictionTime(double time) { friction_time_ = time; }
  double frictionTime() const { return std::min(duration_, friction_time_); }
  /// A substep begins at this fraction: numbers unknowns and surface points, and takes the configuration where it
  /// starts.
  void beginSubstep(double fraction);
  const Eigen::Matrix3Xd& startPoints() const { return points_base_; }
  const std::vector<Pose>& startSolids() const { return poses_base_; }
  /// A stage begins, with its inertia set. `first`: of a substep; then the pattern of the matrix gets room for the
  /// contacts that there are.
  void beginStage(bool first);
  /// Finds the minimum of the stage, while what is prescribed moves from one fraction to the other.
  NewtonResult solve(double from, double to, const NewtonConfig& newton);
  /// Numbers the unknowns anew, when a part holds more than before.
  void numberUnknowns();
  /// The trial, at which a stage ended, becomes the start of the next one.
  void endStage();
  double forceScale() const;   ///< largest force [N]
  double residual() const;     ///< largest unbalanced force [N]
  /// Iterations of sweeps since the step began.
  int linearIterations() const { return linear_iterations_; }

  // ---- for the stability of an equilibrium
  /// From now on all contacts couple, and only the exact matrix is factored.
  void setExact(bool exact);
  /// Puts what is prescribed, and what follows it, where it is at this fraction.
  void place(double fraction);
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  void moveAlong(double alpha);
  void accept();
  /// Directions := -(matrix)^-1 gradients, with the matrix last factored and the gradients of the parts as they are.
  void solveAgain();
  /// The share of the way from the base to the trial that leaves surfaces apart.
  double roomToTrial();

private:
  // the system of a stage, as these need it
  template <class System>
  friend bool isBalanced(const System&, const NewtonConfig&, NewtonResult&, int);
  template <class System>
  friend bool isLastIncrement(System&, const NewtonConfig&, const HessianShift&, double, double);
  template <class System>
  friend NewtonResult minimize(System&, const NewtonConfig&);
  template <class System>
  friend NewtonResult minimizeConfined(System&, double, double, const NewtonConfig&, double);
  void solve();
  void spread();
  void saveBase();
  void restoreBase();
  double stepLimit();
  double incrementSize();
  bool sticksAfter(double rate) const;
  void measureContacts();
  bool anglesMayKeepShift() const { return tolerances.angles_may_keep_shift; }
  double mostUnbalanced() const { return tolerances.most_unbalanced; }
  StepFailure givesUp() const;
  double slope() const;
  double noiseLevel() const;
  Approach approach(double from, double to, double& reached);
  double advance(double from, double to);
  void resolve(double tolerance, double gap_tolerance) { tolerance_ = tolerance, gap_tolerance_ = gap_tolerance; }
  double lagFriction();
  bool stiffen(bool converged);

  /// Four points and a solid of a contact that couples unknowns, and the segments that it turns.
  using Key = std::array<int, 7>;

  template <class F>
  void forAllParts(F&& f) const;
  template <class F>
  void forParts(F&& f) const;
  /// Calls f for all present contacts, and for the terms of the attraction.
  template <class F>
  void forTerms(F&& f) const;
  template <class F>
  void forTurns(const ContactTerm& term, F&& f) const;
  Part& partOf(int point) const { return *part_of_point_[point]; }
  /// The body that carries the points of a term.
  RigidPart& carrierOf(const ContactTerm& term) const { return static_cast<RigidPart&>(partOf(term.point[0])); }
  RigidPart* bodyOf(int solid) const { return solid < 0 ? nullptr : solids[solid].body; }
  bool isOwn(const ContactTerm& term) const { return !exact_ && term.solid >= 0 && !bodyOf(term.solid); }

  /// Whether nothing couples or touches the part.
  static bool isAlone(const Part& part) { return !part.coupled && part.own_terms.empty(); }
  void unsettle();
  void settle();
  void wake(const std::vector<int>& points);
  void wakeGroups();
  bool hasArrived(const Part& part) const;
  void uniteCoupled();
  void limitShares();
  void countPoints();
  void placeSolids(double fraction, std::vector<Pose>& poses) const;
  void gather(Eigen::Matrix3Xd& x, std::vector<Pose>& poses) const;
  void gatherSolids(std::vector<Pose>& poses) const;
  static bool moves(const IslandSolid& solid);
  bool solidsMove() const { return std::any_of(solids.begin(), solids.end(), moves); }
  void take();
  void takeFirst();
  void makeRoom(const ContactTerm& term);
  void takeNewKeys();
  void buildPattern();
  void noteParts();
  void findGroups();
  SharedMatrix::Solver chooseSolver();
  bool sweepsPay();
  SharedMatrix::Bases basesOf(const int (&point)[4]) const;
  std::array<int, 2> turnsOf(const ContactTerm& term) const;
  bool needsRows(const SharedMatrix::Bases& bases, int solid) const;
  void columnsOf(const ContactTerm& term, std::array<Part::Columns, 3>& rows) const;
  void columnsOf(const ContactRow& contact, bool whole, Part::Columns& row) const;
  void addForce(const ContactTerm& term);
  void assemble(const HessianShift& shift, bool whole);
  void addTerm(const ContactTerm& term, const ContactRow* rows, int count, bool whole);
  RodEvaluation evaluateParts(bool with_hessian, const HessianShift& shift);
  bool factor(const HessianShift& shift);
  template <class F>
  void forAverages(F&& f) const;
  template <class F>
  void forConstraints(F&& f) const;
  void follow();

  std::vector<Part*> parts_;
  int threads_ = 1;
  double duration_ = 1.0, friction_time_ = kInfinity;

  SharedMatrix matrix_;
  int multipliers_ = 0;   ///< number of the first multiplier of averages in the matrix, which come last
  /// The matrix knows what parts couple by themselves, and has room for all contacts of keys_.
  bool parts_valid_ = false, keys_valid_ = false;
  bool exact_ = false;
  HessianShift shift_;   ///< of the last evaluation with a Hessian
  int linear_iterations_ = 0;
  std::vector<double> masses_;            ///< result of Part::addTriples() for the coupled parts
  std::vector<Key> keys_, keys_before_;   ///< room for contacts that the pattern has, sorted
  std::vector<Key> new_keys_;             ///< of present contacts that are not in keys_
  std::vector<Key> merged_keys_;
  std::vector<char> coupled_;

  std::unique_ptr<ContactPotential> contact_;
  SurfacePotential* attraction_ = nullptr;
  std::vector<Part*> part_of_point_;
  std::vector<Pose> prescribed_;   ///< per solid that no part carries, at the instant being solved for
  Eigen::Matrix3Xd points_, points_base_, points_end_;
  std::vector<Pose> poses_, poses_base_, poses_end_;   ///< of solids
  /// Per point, turns of segments: at the start of the stage and at the base since the substep began, and at the trial
  /// since the stage began [rad].
  Eigen::VectorXd turns_begin_, turns_base_, turns_;
  MotionShares shares_;
  double least_share_ = 1.0;   ///< least share of the direction that a part goes; set by stepLimit()
  double arrived_ = 0.0;       ///< largest increment of a part that may settle [-]
  /// Parts that contacts or joints connect, or have connected since the pattern of the matrix was begun.
  DisjointSets groups_;
  std::vector<char> group_moves_;   ///< whether a part of the group that has this name is not settled
  /// The last direction was computed without a shift, and parts that met nothing went all of it.
  bool by_newton_ = false, moved_fully_ = false;
  bool pushing_ = false;   ///< contact exerts the forces that it will exert at points_end_ and poses_end_
  /// of increments: over the shortest edge, and at contacts over the smallest gap
  double tolerance_ = 0, gap_tolerance_ = 0;
  double moved_sticking_ = 0;            ///< the largest Part::moved_sticking
  std::vector<Eigen::Vector3d> moves_;   ///< of contacts by the direction [m]
};

}   // namespace slender
