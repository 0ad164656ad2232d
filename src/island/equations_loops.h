#pragma once

#include "island/equations.h"
#include "linalg/parallel_for.h"

/// Loops over the parts and the contacts of an island. Private to Equations.
namespace slender {

template <class F>
void Equations::forAllParts(F&& f) const
{
  parallelFor(threads_, static_cast<int>(parts_.size()), 4, [&](int k) { f(*parts_[k]); });
}

/// Leaves out settled parts.
template <class F>
void Equations::forParts(F&& f) const
{
  forAllParts([&](Part& part) {
    if (!part.settled)
      f(part);
  });
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
