#include "slender_sim/study/study.h"

#include <algorithm>

namespace slender::study {

namespace {

std::vector<Study>& registeredStudies()
{
  static std::vector<Study> all;
  return all;
}

}   // namespace

StudyRegistration::StudyRegistration(const char* name, const char* description, void (*run)(StudyContext&),
                                     bool numbered)
{
  std::vector<Study>& all = registeredStudies();
  const auto before = [](const Study& study, const std::string& other) { return study.name < other; };
  all.insert(std::lower_bound(all.begin(), all.end(), std::string(name), before),
             Study{name, description, run, numbered});
}

const std::vector<Study>& studies() { return registeredStudies(); }

const Study* findStudy(const std::string& name)
{
  for (const Study& s : studies())
    if (s.name == name)
      return &s;
  return nullptr;
}

}   // namespace slender::study
