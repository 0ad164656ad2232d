// Explains the keys of scene files, as the reader itself asks for them.
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_reference.h"

int main(int argc, char** argv)
try
{
  const char* const usage =
      "usage: scene_reference                  all keys of scene files with values and meaning, in Markdown\n"
      "       scene_reference --key KEY        one key and all keys below it: rods.N.material, or a path of your "
      "scene\n"
      "                                        as rods.0.grasps.left.attach\n"
      "       scene_reference --key WORD       all keys of this name: attach\n"
      "       scene_reference SCENE.yaml...    the keys that are asked for as these scenes are read, in Markdown\n";
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 1 && (arguments[0] == "--help" || arguments[0] == "-h"))
  {
    std::cout << usage;
    return 0;
  }
  if (arguments.size() == 2 && arguments[0] == "--key")
  {
    const std::vector<slender::SceneKey> keys = slender::sceneKeys();
    const std::string text = slender::describeKeys(keys, arguments[1]);
    if (text.empty())
    {
      const std::string nearest = slender::nearestKey(keys, arguments[1]);
      std::cerr << "scene_reference: no key " << arguments[1]
                << (nearest.empty() ? "" : " (did you mean " + nearest + "?)") << std::endl;
      return 2;
    }
    std::cout << text;
    return 0;
  }
  if (!arguments.empty() && arguments[0].rfind("--", 0) == 0)
  {
    std::cerr << usage;
    return 2;
  }
  std::cout << slender::sceneReference(arguments.empty() ? slender::sceneKeys() : slender::sceneKeys(arguments));
  return 0;
}
catch (const std::exception& e)
{
  std::cerr << e.what() << std::endl;
  return 2;
}
