#include "subject.h"

#include <tools/cli/build/build_names.h>

#include <iterator>

namespace hiprt::bench {

std::vector<Subject> policy_subjects() {
  std::vector<Subject> subjects;
  for (const Compiler settings : {Compiler::kUsual, Compiler::kFastMath})
    for (std::size_t i = 0; i < (settings == Compiler::kUsual ? std::size(kPolicySets) : kFastMathSets); ++i) {
      const PolicySet& set = kPolicySets[i];
      const bool fast = settings == Compiler::kFastMath;
      Subject subject;
      subject.name = std::string(set.name) + (fast ? " (fast-math)" : "");
      subject.triangle = set.triangle;
      subject.boxes = set.boxes;
      subject.layout = tools::word_of(tools::kLayouts, set.layout);
      subject.compiler = fast ? "fast-math" : "usual";
      subject.set = i;
      subject.settings = settings;
      subjects.push_back(std::move(subject));
    }
  return subjects;
}

std::vector<Subject> embree_subjects() {
  std::vector<Subject> subjects(2);
  for (Subject& subject : subjects) subject.ours = false;
  subjects[0].name = "Embree";
  subjects[1].name = "Embree robust";
  subjects[1].robust = true;
  return subjects;
}

std::vector<Subject> vulkan_subjects(const std::vector<std::string>& modes) {
  std::vector<Subject> subjects(modes.size());
  for (std::size_t i = 0; i < modes.size(); ++i) {
    subjects[i].name = "Vulkan " + modes[i];
    subjects[i].ours = false;
    subjects[i].vulkan = modes[i];
  }
  return subjects;
}

}  // namespace hiprt::bench
