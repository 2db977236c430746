// Breaks both rules of isa_symbols.sh: a function that other objects could define too, and a constructed global.

__attribute__((noinline)) inline float scale(float x) { return x * 3.0f; }

struct Constructed {
  Constructed();
  float value;
};
Constructed::Constructed() : value(scale(2.0f)) {}

Constructed global;

float entry_x86_64_v3(float x) { return scale(x) + global.value; }
