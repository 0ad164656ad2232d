#pragma once

#include <vector>

#include "island/island.h"
#include "thread/merging.h"
#include "thread/thread_part.h"

namespace slender {

/// The merging of the threads of an island. Its objects come behind those of the rods.
class ThreadMerging : public SubstepPotential
{
public:
  void setParts(const std::vector<ThreadPart*>& parts) { parts_ = parts; }

  void begin(const Eigen::Matrix3Xd& x, const ContactSurface& surface, const std::vector<GridPairs::Pair>& pairs,
             double gap, double h) override;
  double largestForce() const override { return merging_.largestAttraction(); }
  double evaluate(const Eigen::Matrix3Xd& x, bool with_stiffness) override
  {
    return merging_.evaluate(x, with_stiffness);
  }
  const std::vector<ContactTerm>& terms() const override { return merging_.terms(); }

private:
  MergingPotential merging_;
  std::vector<ThreadPart*> parts_;
  std::vector<MergingFluid> fluids_;   ///< per object
  std::vector<char> held_;             ///< per point
};

}   // namespace slender
