#version 330 core
// Rays of a camera behind a port and two mirrors, from the layers of `mirrorgaze export-camera RIG -o camera.exr`.
// Metres and radians in the body frame (x ahead, y left, z up). Put your scene into seen(); hull and mount are yours too.

uniform sampler2D origin;         // origin.X, .Y, .Z as red, green, blue, 32-bit floats; first row of the file first
uniform sampler2D direction;      // direction.X, .Y, .Z
uniform sampler2D status;         // status.Y: 0 where there is a ray
uniform mat4 body_from_m1;        // this and all below but the joint values: the file's header
uniform mat4 body_from_gimbal;
uniform vec4 m1_outline;          // half width, half height, largest abs(x) + abs(y), 1 for an ellipse
uniform vec4 m2_outline;
uniform vec4 pan;                 // sign, offset, lowest, highest joint value
uniform vec4 tilt;
uniform float q1;                 // joint values
uniform float q2;
out vec4 colour;

struct Ray {
    vec3 origin;
    vec3 direction;
    int path;                     // 0 housing, 1 direct, 2 the fold mirror, 3 fold and gaze mirror
    bool blocked;                 // ends at the back of a mirror
};

mat4 gaze_mirror_pose() {
    float a = pan.x * q1 + pan.y;
    float e = tilt.x * q2 + tilt.y + 0.7853981633974483;
    mat4 turn = mat4(cos(a), sin(a), 0, 0, -sin(a), cos(a), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
    mat4 face = mat4(0, 1, 0, 0, -sin(e), 0, cos(e), 0, cos(e), 0, sin(e), 0, 0, 0, 0, 1);
    return body_from_gimbal * turn * face;
}

Ray over(Ray ray, mat4 pose, vec4 outline, int number) {
    vec3 normal = pose[2].xyz;
    vec3 centre = pose[3].xyz;
    float approach = dot(ray.direction, normal);
    float along = dot(centre - ray.origin, normal) / approach;
    vec3 point = ray.origin + along * ray.direction;
    float u = abs(dot(point - centre, pose[0].xyz));
    float v = abs(dot(point - centre, pose[1].xyz));
    bool in_ellipse = u * u / (outline.x * outline.x) + v * v / (outline.y * outline.y) <= 1.0;
    bool in_cut = u <= outline.x && v <= outline.y && u + v <= outline.z;
    bool inside = (outline.w > 0.5 && in_ellipse) || (outline.w < 0.5 && in_cut);
    if (ray.path != number || ray.blocked || !inside || !(along > 0.0)) {
        return ray;
    }
    if (approach < 0.0) {
        return Ray(point, reflect(ray.direction, normal), number + 1, false);
    }
    return Ray(ray.origin, ray.direction, 2, true);
}

Ray ray_at(ivec2 texel) {
    int path = int(texelFetch(status, texel, 0).x < 0.5);
    Ray ray = Ray(texelFetch(origin, texel, 0).xyz, texelFetch(direction, texel, 0).xyz, path, false);
    return over(over(ray, body_from_m1, m1_outline, 1), gaze_mirror_pose(), m2_outline, 2);
}

vec3 seen(Ray ray) {
    return 0.5 + 0.5 * normalize(ray.direction);
}

void main() {
    int row = textureSize(direction, 0).y - 1 - int(gl_FragCoord.y);
    Ray ray = ray_at(ivec2(int(gl_FragCoord.x), row));
    colour = vec4(0.0, 0.0, 0.0, 1.0);
    if (ray.path > 0 && !ray.blocked) {
        colour = vec4(seen(ray), 1.0);
    }
}
