#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace slender {

class Simulation;

/// Fields of one object at one instant; one row per node, vertex, or for `energies` one in all.
struct FieldTable
{
  /// name of the table that the rows belong to: rod_fields, cloth_fields, solid_fields or energies
  std::string table;
  std::string object;
  std::vector<std::string> columns;   ///< names with units, e.g. "tension [N]"
  /// rows x columns; NaN: the state does not determine the value, the cell stays empty
  Eigen::MatrixXd values;
};

/// What `record.fields` of the scene asks for, at the present instant. Empty, and nothing is computed, when it asks for
/// nothing.
std::vector<FieldTable> fieldTablesOf(const Simulation& simulation);

}   // namespace slender
