// Collisions of cloth: pairs by themselves, then scenes after every step of which an exact check of all pairs looks for intersections.
#include "collision_pairs.h"

namespace slender::study {

void runClothCollisionSafety(StudyContext& context)
{
  runCollisionPairs(context, context.quick() ? 52'000 : 1'040'000);
}

}  // namespace slender::study
