#pragma once

#include "slender_sim/dynamics/newton.h"
#include "island/part.h"

namespace slender::test {

/// One part with what minimize() needs of a system: alone with its own matrix, or coupled through a matrix of its own.
/// Contacts in the lists own_terms and own_rows of the part act either way.
struct PartDriver
{
  Part& part;
  bool coupled;
  SharedMatrix matrix{false};

  PartDriver(Part& p, bool couple) : part(p), coupled(couple) {}

  /// Comes after the stage of the part has begun.
  NewtonResult solve(const NewtonConfig& newton)
  {
    begin();
    return minimize(*this, newton);
  }
  void begin()
  {
    const bool known = part.numberUnknowns() && part.coupled == coupled;
    part.coupled = coupled;
    if (known || !coupled)
      return;
    matrix.begin(part.unknowns());
    part.notePattern(matrix);
    for (const ContactTerm* term : part.own_terms)
      matrix.noteBases(basesOf(term->point));
    matrix.finish();
    part.findEntries(matrix);
  }
  SharedMatrix::Bases basesOf(const int (&point)[4]) const
  {
    SharedMatrix::Bases bases;
    for (int p = 0; p < 4; ++p)
      bases[p] = point[p] < 0 ? Part::kPrescribed : part.base(point[p] - part.first_point);
    return bases;
  }

  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {})
  {
    part.evaluate(with_hessian, shift);
    if (!coupled)
      return part.evaluation;
    for (const ContactTerm* term : part.own_terms)
      for (int p = 0; p < 4; ++p)
        if (term->point[p] >= 0)
          part.addForce(term->point[p] - part.first_point, term->share(p, term->force));
    RodEvaluation e = part.evaluation;
    if (with_hessian)
      e.inertia.negative = !matrix.factorExactly([&](bool) {
        matrix.clear();
        part.addHessian(matrix, shift);
        for (const ContactTerm* term : part.own_terms)
          matrix.addTerm(*term, nullptr, 0, basesOf(term->point), false);
        ContactTerm none;
        for (const ContactRow* row : part.own_rows)
          matrix.addTerm(none, row, 1, basesOf(row->point), false);
      });
    part.closeGradient();
    return e;
  }
  void solve()
  {
    if (!coupled)
    {
      part.solve();
      return;
    }
    part.takeGradient(matrix.solution());
    matrix.solve();
    part.takeDirection(matrix.solution());
  }
  void moveAlong(double alpha) { part.moveAlong(alpha); }
  void accept() { part.accept(); }
  void saveBase() { part.saveBase(); }
  void restoreBase() { part.restoreBase(); }
  double stepLimit() const { return part.stepLimit(); }
  double incrementSize() const { return part.incrementSize(1.0); }
  double slope() const { return part.slope(); }
  double residual() const { return part.residual(); }
  double forceScale() const { return part.forceScale(); }
  double noiseLevel() const { return part.noiseLevel(); }
  static constexpr bool anglesMayKeepShift() { return false; }
  static constexpr bool sticksAfter(double) { return true; }
  StepFailure givesUp() const { return part.givesUp(); }
  static constexpr double mostUnbalanced() { return 1e-3; }
};

}   // namespace slender::test
