#version 460
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec4 result;

void main() {
  result = uvec4(floatBitsToUint(gl_HitTEXT), gl_InstanceID, gl_GeometryIndexEXT, gl_PrimitiveID);
}
