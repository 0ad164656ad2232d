#include "generators.h"

namespace slender {

Eigen::Vector3d readDirection(const YamlCursor& at, const Eigen::Vector3d& otherwise)
{
  const auto vector = at.vector3(Range::closed(-1e6, 1e6));
  if (vector && !(vector->norm() > 0))
  {
    at.problem("must not be zero");
    return otherwise;
  }
  return vector.value_or(otherwise).normalized();
}

Generated readGenerators(const YamlCursor& at, const ReadContext& context, int first_rod)
{
  Generated all;
  for (const YamlCursor& item : at.items())
  {
    YamlMap map(item);
    const YamlCursor chain = map.get("chain", "A chain of round links, each of which is a rod.");
    const YamlCursor tree = map.get("tree", "A tree: each branch is a tapered rod, and small balls join the branches.");
    const YamlCursor hair = map.get("hair", "Strands of hair on a ball, which is an obstacle; each strand is a rod.");
    map.finish();
    if (!map.sound() || !map.hasOne({chain, tree, hair}, "must be one of {chain: {...}}, {tree: {...}}, {hair: {...}}"))
      continue;
    if (chain.present())
      generateChain(chain, context, all);
    else if (tree.present())
      generateTree(tree, context, first_rod + static_cast<int>(all.rods.size()), all);
    else
      generateHair(hair, context, all);
  }
  return all;
}

}   // namespace slender
