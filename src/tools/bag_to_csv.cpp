#include "export_program.h"
#include "slender_sim/scene/csv_tables.h"

/// bag_to_csv BAG --out DIR: the tables that simulate --csv writes, from a bag.
namespace {

const char* const name = "bag_to_csv";
const char* const usage =
    "usage: bag_to_csv BAG --out DIR [options]\n"
    "  --out DIR        new or empty folder for nodes.csv, grasps.csv, and of scenes that have them threads.csv, "
    "cloths.csv, bodies.csv, tracking.csv, and tables of fields:\n"
    "                   the tables of simulate --csv\n"
    "  --namespace NS   of the recorded topics, e.g. /rod_node; needed for a bag of several nodes\n"
    "  --scene-dir DIR  where the files lie that the recorded scene names (default: here); needed for tracking.csv\n"
    "  --quiet          print nothing but errors\n"
    "Exit status: 0 done, 2 bad input, 3 writing failed.\n";

void run(const slender::ExportOptions& options)
{
  slender::BagReader bag =
      slender::openBag(name, options, "times are taken from the stamps, and tracking.csv is left out,");
  slender::Staged folder(slender::Staged::Kind::folder, options.out);
  slender::CsvTables tables(folder.part());
  slender::eachInstant(name, options, bag, [&](const slender::SceneSnapshot& instant) { tables.write(instant); });
  tables.finish();
  folder.keep();
}

}   // namespace

int main(int argc, char** argv) { return slender::exportProgram(name, usage, argc, argv, {}, run); }
