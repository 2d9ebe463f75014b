"use strict";
// Shaders of the 3D view: bodies moved by a factor, coloured by a value, lit from the eye.

const VERTEX = `#version 300 es
in vec3 position;
in vec3 moved;
in float value;
in float part;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
uniform float uFactor;
uniform float uSize;
uniform float uNearer;
out vec3 vEye;
out float vValue;
flat out float vPart;
void main() {
  vec3 at = position + uFactor * moved;
  vec4 eye = modelViewMatrix * vec4(at.x, at.z, -at.y, 1.0);
  vEye = eye.xyz;
  vValue = value;
  vPart = part;
  gl_Position = projectionMatrix * eye;
  gl_Position.z -= uNearer * gl_Position.w;
  gl_PointSize = uSize * projectionMatrix[1][1] / max(-eye.z, 1e-6);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 vEye;
in float vValue;
flat in float vPart;
uniform vec3 uStops[10];
uniform float uCount;
uniform vec3 uColour;
uniform float uAlpha;
uniform float uChosen;
uniform float uFlat;
uniform float uPicking;
uniform float uBalls;
out vec4 colour;
vec3 scaled(float share) {
  float place = clamp(share, 0.0, 1.0) * (uCount - 1.0);
  int index = int(min(floor(place), uCount - 2.0));
  return mix(uStops[index], uStops[index + 1], place - float(index));
}
void main() {
  vec3 normal = normalize(cross(dFdx(vEye), dFdy(vEye)));
  if (uBalls > 0.5) {
    vec2 at = 2.0 * gl_PointCoord - 1.0;
    if (dot(at, at) > 1.0) discard;
    normal = vec3(at, sqrt(1.0 - dot(at, at)));
  }
  if (uPicking > 0.5) {
    float id = vPart + 1.0;
    colour = vec4(mod(id, 256.0) / 255.0, floor(id / 256.0) / 255.0, 0.0, 1.0);
    return;
  }
  vec3 base = vValue < -0.5 || uFlat > 0.5 ? uColour : scaled(vValue);
  if (uChosen > -0.5 && abs(vPart - uChosen) > 0.5) base = mix(base, vec3(0.93), 0.8);
  float light = mix(0.68 + 0.32 * abs(normal.z), 1.0, uFlat);
  colour = vec4(base * light * uAlpha, uAlpha);
}`;
