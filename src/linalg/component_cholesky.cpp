#include "component_cholesky.h"

#include <algorithm>

#include "parallel_for.h"

namespace slender {

/// Numbers the components in the order of their first unknowns.
void ComponentCholesky::findComponents(const std::vector<int>& starts, const std::vector<int>& rows)
{
  const int n = static_cast<int>(starts.size()) - 1;
  sets_.begin(n);
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
      sets_.unite(j, rows[k]);
  components_.clear();
  component_of_.resize(n);
  number_.resize(n);
  for (int u = 0; u < n; ++u)
  {
    if (const int first = sets_.of(u); first != u)
      component_of_[u] = component_of_[first];
    else
    {
      component_of_[u] = static_cast<int>(components_.size());
      components_.emplace_back();
    }
    std::vector<int>& unknowns = components_[component_of_[u]].unknowns;
    number_[u] = static_cast<int>(unknowns.size());
    unknowns.push_back(u);
  }
}

void ComponentCholesky::analyse(Component& component)
{
  const auto [first, end] = known_.equal_range(component.hash);
  const auto same = std::find_if(first, end, [&](const auto& known) {
    return known.second.starts == component.starts && known.second.rows == component.rows &&
           known.second.multipliers == component.multipliers;
  });
  if (same != end)
  {
    component.cholesky = std::move(same->second.cholesky);
    known_.erase(same);
    return;
  }
  component.cholesky.emplace(simplicial_ && component.multipliers == 0);
  component.cholesky->setPattern(static_cast<int>(component.unknowns.size()), component.starts, component.rows,
                                 component.multipliers);
}

void ComponentCholesky::setPattern(const std::vector<int>& starts, const std::vector<int>& rows, int multipliers)
{
  constexpr std::uint64_t kBasis = 0xcbf29ce484222325, kPrime = 0x100000001b3;   // Constants of the hash FNV-1a.
  for (Component& component : components_)
    known_.emplace(component.hash, std::move(component));
  findComponents(starts, rows);
  const auto mix = [](Component& component, int number) { component.hash = (component.hash ^ number) * kPrime; };
  for (Component& component : components_)
  {
    component.hash = kBasis;
    component.starts.push_back(0);
    component.x.resize(component.unknowns.size());
  }
  const std::size_t first_multiplier = component_of_.size() - multipliers;
  for (std::size_t u = 0; u < component_of_.size(); ++u)
  {
    Component& component = components_[component_of_[u]];
    component.multipliers += u >= first_multiplier;
    for (int k = starts[u]; k < starts[u + 1]; ++k)
    {
      component.entries.push_back(k);
      component.rows.push_back(number_[rows[k]]);
      mix(component, component.rows.back());
    }
    component.starts.push_back(static_cast<int>(component.rows.size()));
    mix(component, component.starts.back());
  }
  for (Component& component : components_)
    analyse(component);
  known_.clear();
}

bool ComponentCholesky::factor(const std::vector<double>& values, const std::vector<char>& idle, int threads)
{
  parallelFor(threads, static_cast<int>(components_.size()), 1, [&](int n) {
    Component& component = components_[n];
    component.idle = idle[component.unknowns.front()];
    if (component.idle)
      return;
    double* own = component.cholesky->values();
    for (std::size_t k = 0; k < component.entries.size(); ++k)
      own[k] = values[component.entries[k]];
    component.definite = component.cholesky->factor();
  });
  return std::all_of(components_.begin(), components_.end(), [](const Component& c) { return c.idle || c.definite; });
}

void ComponentCholesky::solve(double* x, int threads)
{
  parallelFor(threads, static_cast<int>(components_.size()), 1, [&](int n) {
    Component& component = components_[n];
    if (component.idle)
      return;
    for (std::size_t k = 0; k < component.unknowns.size(); ++k)
      component.x[k] = x[component.unknowns[k]];
    component.cholesky->solve(component.x.data());
    for (std::size_t k = 0; k < component.unknowns.size(); ++k)
      x[component.unknowns[k]] = component.x[k];
  });
}

}   // namespace slender
