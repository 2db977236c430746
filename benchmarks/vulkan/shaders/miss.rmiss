#version 460
#extension GL_EXT_ray_tracing : require

#ifdef ANY_HIT
layout(location = 0) rayPayloadInEXT uint found;
void main() { found = 0u; }
#else
layout(location = 0) rayPayloadInEXT uvec4 result;
void main() { result = uvec4(0x7f800000u, 0xffffffffu, 0xffffffffu, 0xffffffffu); }
#endif
