#include <tools/scene_io/scene/scene_order.h>

namespace hiprt::tools {

GroupOrder order_groups(std::span<const std::vector<build::Instance>> groups, std::size_t objects, std::size_t top) {
  enum class State : unsigned char { kNew, kOpen, kDone };
  struct Step {
    std::size_t group, next;
  };
  GroupOrder order;
  order.used_objects.resize(objects);
  std::vector<State> states(groups.size(), State::kNew);
  std::vector<Step> path{{top, 0}};
  states[top] = State::kOpen;
  while (!path.empty()) {
    Step& step = path.back();
    if (step.next == groups[step.group].size()) {
      states[step.group] = State::kDone;
      order.groups.push_back(step.group);
      path.pop_back();
      continue;
    }
    const std::size_t object = groups[step.group][step.next++].object;
    if (object < objects) {
      order.used_objects[object] = true;
      continue;
    }
    const std::size_t group = object - objects;
    if (states[group] == State::kOpen) {
      GroupCycle cycle{{}, step.next - 1};
      for (const Step& on_path : path)
        if (!cycle.groups.empty() || on_path.group == group) cycle.groups.push_back(on_path.group);
      order.cycle = std::move(cycle);
      return order;
    }
    if (states[group] == State::kDone) continue;
    states[group] = State::kOpen;
    path.push_back({group, 0});
  }
  return order;
}

}  // namespace hiprt::tools
