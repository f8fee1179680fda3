"""A game of one's own in fifteen lines: a ball that follows the orb's commands.

Presses at the left, right and bottom move it, a pinch brings it back to the middle. The arrow keys
press a virtual orb there; a real orb ignores them.
"""

import pygame

import orbtouch

STEPS, MIDDLE = {"left": (-40, 0), "right": (40, 0), "down": (0, 40)}, pygame.Vector2(600, 200)
FINGERS = {pygame.K_LEFT: (0.5, 2), pygame.K_RIGHT: (3.5, 2), pygame.K_DOWN: (2, 0.5)}

screen, ball, clock = pygame.display.set_mode((800, 400)), MIDDLE, pygame.Clock()
with orbtouch.connect() as orb:  # a virtual orb, or connect("/dev/rfcomm0")
    while not pygame.event.peek(pygame.QUIT):
        orb.touch(*(at for key, at in FINGERS.items() if pygame.key.get_pressed()[key]))
        for command in orb.commands():
            ball = MIDDLE if command.name == "drop" else ball + STEPS.get(command.name, (0, 0))
        screen.fill("black")
        orb.draw(screen, pygame.Rect(0, 0, 400, 400))
        pygame.draw.circle(screen, "orange", ball, 20)
        pygame.display.flip()
        clock.tick(60)
