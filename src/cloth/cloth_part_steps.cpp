// A cloth in the substeps of an island: its surface, and what it asks of contact.
#include <algorithm>

#include "cloth_part.h"

namespace slender {

void ClothPart::setContact(const ContactProperties& contact, double step, const std::vector<IgnoredSolid>& ignored)
{
  ignored_ = ignored.empty() ? nullptr : std::make_shared<std::vector<IgnoredSolid>>(ignored);
  contact_ = contact;
  contact_step_ = step;
  rest_ = std::make_shared<Eigen::Matrix3Xd>(work_.model->rest.vertices);
  ++surface_version_;
}

void ClothPart::setPins(const std::vector<int>& pins)
{
  if (pins == surface_pins_)
    return;
  surface_pins_ = pins;
  ++surface_version_;
}

void ClothPart::addSurface(ContactSurface& surface) const
{
  const int first = surface.points;
  surface.points += points();
  if (!contact_)
    return;
  const Eigen::Matrix3Xi& triangles = work_.model->rest.triangles;
  ContactTriangle t;
  t.object = static_cast<int>(surface.objects.size());
  t.half_thickness = 0.5 * contact_->thickness;
  for (Eigen::Index i = 0; i < triangles.cols(); ++i)
  {
    t.driven = 0;
    for (int k = 0; k < 3; ++k)
    {
      const int corner = triangles(k, i);
      t.corner[k] = first + corner;
      // pins are in rising order
      if (std::binary_search(surface_pins_.begin(), surface_pins_.end(), corner))
        t.driven = static_cast<unsigned char>(t.driven | 1 << k);
    }
    surface.triangles.push_back(t);
  }
  constexpr int kNoThread = -1;
  surface.objects.push_back({*contact_, 0.0, false, kNoThread, rest_, first, ignored_});
}

/// A contact force that every scene meets: the weight of a vertex, or what stops it within the gap in a step.
BarrierRange ClothPart::barrierRange(double gap) const
{
  BarrierRange range;
  if (contact_)
    range.least = work_.model->mass.maxCoeff() * std::max(10.0, gap / (contact_step_ * contact_step_));
  return range;
}

BoundingBox ClothPart::surfaceBox(double ahead) const
{
  BoundingBox box = BoundingBox::empty();
  if (!contact_)
    return box;
  const ClothState& state = work_.present();
  for (Eigen::Index i = 0; i < state.x.cols(); ++i)
    box.include(state.x.col(i) + ahead * state.v.col(i));
  for (std::size_t k = 0; ahead > 0.0 && k < state.pins.size(); ++k)
    box.include(work_.pinAt(k, std::min(1.0, ahead / contact_step_)));
  box.enlarge(0.5 * contact_->thickness);
  return box;
}

}   // namespace slender
