// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a surface's areas to its cell.
#version 450 core

flat in vec4 front;
flat in vec4 back;

layout(location = 0) out vec4 out_front;
layout(location = 1) out vec4 out_back;

void main()
{
    out_front = front;
    out_back = back;
}
