#pragma once

#include "island/equations.h"

#ifdef _OPENMP
#include <omp.h>
#endif

/// Loops over the parts and the contacts of an island. Private to Equations.
namespace slender {

/// Leaves out settled parts.
template <class F>
void Equations::forParts(F&& f)
{
  if (!parallel_ || threads_ == 1)
  {
    for (Part* part : parts_)   // OpenMP would take memory for its one thread
      if (!part->settled)
        f(*part);
    return;
  }
  const int count = static_cast<int>(parts_.size());
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads_ > 0 ? threads_ : omp_get_max_threads())
#endif
  for (int k = 0; k < count; ++k)
    if (!parts_[k]->settled)
      f(*parts_[k]);
}

template <class F>
void Equations::forTerms(F&& f) const
{
  if (contact_)
    for (const ContactTerm& term : contact_->terms())
      f(term);
  if (attraction_)
    for (const ContactTerm& term : attraction_->terms())
      f(term);
}

/// Calls f(part, point, column) for the segments of curves that a term turns; `point` counts from 0 in the part.
template <class F>
void Equations::forTurns(const ContactTerm& term, F&& f) const
{
  for (const ContactTerm::Turn& turn : term.turn)
    if (turn.point >= 0)
      f(partOf(turn.point), turn.point - partOf(turn.point).first_point, turn.column);
}

}   // namespace slender
