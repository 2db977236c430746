// The members of HIPRT's stacks, for programs that call them.

#include <tests/compat/scenes.h>

using namespace hiprt;
using namespace hiprt::test;

TEST_CASE("HIPRT's stacks hold what is pushed") {
  std::uint32_t shared[4] = {}, global[60] = {};
  const hiprtSharedStackBuffer shared_buffer{4, shared};
  const hiprtGlobalStackBuffer global_buffer{60, 1, global};
  const auto check = [](auto&& stack, std::uint32_t capacity) {
    for (unsigned round = 0; round < 2; ++round) {
      CHECK(stack.empty());
      CHECK(stack.vacancy() == capacity);
      for (std::uint32_t i = 0; i < capacity; ++i) stack.push(100 + i);
      CHECK(stack.vacancy() == 0);
      CHECK_FALSE(stack.empty());
      for (std::uint32_t i = capacity; i-- > capacity / 2;) CHECK(stack.pop() == 100 + i);
      stack.reset();
    }
  };
  check(hiprtPrivateStack(), 64);
  check(hiprtDynamicStack(global_buffer, shared_buffer), 64);
  check(hiprtGlobalStack(global_buffer, shared_buffer), 64);
  check(hiprtGlobalStack(global_buffer, {0, nullptr}), 60);
  check(hiprtGlobalStack(global_buffer, {16, nullptr}), 60);
}

TEST_CASE("HIPRT's instance stacks hold what is pushed") {
  hiprtInstanceStackEntry global[5];
  const auto check = [](auto&& stack, std::uint32_t capacity) {
    CHECK(stack.vacancy() == capacity);
    for (std::uint32_t i = 0; i < capacity; ++i)
      stack.push({make_ray({static_cast<float>(i), 0, 0}, {0, 0, 1}), nullptr});
    for (std::uint32_t i = capacity; i-- > 0;) CHECK(stack.pop().ray.origin.x == static_cast<float>(i));
    CHECK(stack.empty());
  };
  check(hiprtPrivateInstanceStack(), 3);
  check(hiprtGlobalInstanceStack({5, 1, global}, {}), 5);
  check(hiprtDynamicInstanceStack({5, 1, global}, {}), 3);
  CHECK(hiprtEmptyInstanceStack().vacancy() == 0);
}
